"""The curriculum through a set of goal graphs, from the easiest on."""

from __future__ import annotations

from hierroom.complexity.graph_set import GraphSet
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError


class Curriculum:
    """Moves through a set of goal graphs depending on how often the agent escapes; the caller keeps the stage.

    Args:
        graphs: the whole set.
        n_stages: number of parts into which it is divided, at least 1; see `GraphSet.stages`.
        promote_at: the next stage begins at this success rate or above.
        demote_at: the previous stage returns below this success rate; 0 <= demote_at < promote_at <= 1.

    Attributes:
        stages: the graphs of each stage, from the easiest on.
    """

    def __init__(self, graphs: GraphSet, n_stages: int = 5, promote_at: float = 0.8, demote_at: float = 0.2):
        if n_stages < 1:
            raise InputError(f"a curriculum needs at least one stage, not {n_stages}")
        if not 0 <= demote_at < promote_at <= 1:
            raise InputError(
                "a curriculum needs 0 <= demote_at < promote_at <= 1, "
                f"not demote_at {demote_at:g} and promote_at {promote_at:g}"
            )
        self.stages: tuple[tuple[GoalGraph, ...], ...] = graphs.stages(n_stages)
        self._promote_at, self._demote_at = promote_at, demote_at

    def advance(self, stage: int, success_rate: float) -> int:
        """Return the next, the current or the previous stage, 0 to ``len(stages) - 1``.

        ``success_rate``, 0..1, is the fraction of the stage's most recent episodes in which the agent escaped.
        """
        last = len(self.stages) - 1
        if not 0 <= stage <= last:
            raise InputError(f"the stages are 0 to {last}; there is no stage {stage}")
        if not 0 <= success_rate <= 1:
            raise InputError(f"a success rate must be in 0..1, not {success_rate:g}")
        step = int(success_rate >= self._promote_at) - int(success_rate < self._demote_at)
        return min(max(stage + step, 0), last)
