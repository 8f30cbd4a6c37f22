"""Goal graphs by difficulty: those in an interval, one at random, and a curriculum that moves along the interval."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hierroom.complexity.report import analyze
from hierroom.errors import InputError
from hierroom.goals import MAX_GRID_ROOMS, GoalGraph, enumerate_graphs

QUANTITIES = ("hitting_time", "expected_steps")
_SPEC = re.compile(r"(?P<quantity>\w+):(?P<low>\d+(?:\.\d+)?)\.\.(?P<high>\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Difficulty:
    """An interval of difficulty, and so the goal graphs in it.

    Args:
        low: least value, included.
        high: greatest value, included.
        quantity: `"hitting_time"`, the paper's value, which saturates near 100 and so tells the hardest graphs badly
            apart, or `"expected_steps"`, the true mean, which does not.
        drop_key: whether keys can be dropped, which makes every graph harder.
        max_rooms: graphs with more rooms are left out; the default is what a grid can draw.

    Raises:
        InputError: if an argument is not valid, or no goal graph is that difficult.
    """

    low: float
    high: float
    quantity: str = "hitting_time"
    drop_key: bool = False
    max_rooms: int = MAX_GRID_ROOMS

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InputError(f"difficulty is measured by {' or '.join(QUANTITIES)}, not {self.quantity}")
        if not 0 <= self.low <= self.high < float("inf"):
            raise InputError(f"an interval of difficulty runs from low to high, not from {self.low:g} to {self.high:g}")
        if not 2 <= self.max_rooms <= MAX_GRID_ROOMS:
            raise InputError(f"graphs by difficulty have 2 to {MAX_GRID_ROOMS} rooms, not {self.max_rooms}")
        if not self.graphs:
            values = [value for value, _ in graphs_by_difficulty(self.quantity, self.drop_key, self.max_rooms)]
            raise InputError(
                f"no goal graph of up to {self.max_rooms} rooms has a {self.quantity} in {self.low:g}..{self.high:g}; "
                f"they run from {values[0]:.2f} to {values[-1]:.2f}"
            )

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """Every goal graph in the interval, up to renaming, the easiest first."""
        ranked = graphs_by_difficulty(self.quantity, self.drop_key, self.max_rooms)
        return tuple(graph for value, graph in ranked if self.low <= value <= self.high)

    def sample(self, rng: np.random.Generator) -> GoalGraph:
        """One of `graphs`, each as likely as the others."""
        return self.graphs[int(rng.integers(len(self.graphs)))]


@dataclass(frozen=True)
class Curriculum:
    """Moves through an interval of difficulty by how often the agent escapes.

    The interval is cut into stages of equal width, and those without a goal graph are left out. The state of a
    curriculum is one number, the stage; nothing here changes.

    Args:
        difficulty: the whole interval.
        n_stages: into how many parts it is cut, at least one.
        promote_at: success rate from which the next stage begins.
        demote_at: success rate below which the stage before comes back.

    Raises:
        InputError: if an argument is not valid.
    """

    difficulty: Difficulty
    n_stages: int = 5
    promote_at: float = 0.8
    demote_at: float = 0.2

    def __post_init__(self) -> None:
        if self.n_stages < 1:
            raise InputError(f"a curriculum has at least one stage, not {self.n_stages}")
        if not 0 <= self.demote_at < self.promote_at <= 1:
            raise InputError(
                "a curriculum needs 0 <= demote_at < promote_at <= 1, "
                f"not demote_at {self.demote_at:g} and promote_at {self.promote_at:g}"
            )

    @property
    def stages(self) -> tuple[Difficulty, ...]:
        """The stages in order; together they hold every graph of the interval, each once."""
        whole = self.difficulty
        between = np.linspace(whole.low, whole.high, self.n_stages + 1)[1:-1]
        ranked = graphs_by_difficulty(whole.quantity, whole.drop_key, whole.max_rooms)
        values = np.array([value for value, _ in ranked if whole.low <= value <= whole.high])
        stage_of = np.searchsorted(between, values, side="right")
        inside = [values[stage_of == stage].tolist() for stage in np.unique(stage_of)]
        return tuple(
            Difficulty(stage[0], stage[-1], whole.quantity, whole.drop_key, whole.max_rooms) for stage in inside
        )

    def advance(self, stage: int, success_rate: float) -> int:
        """The stage that follows.

        Args:
            stage: the present one, 0 to ``len(stages) - 1``; a curriculum begins at 0.
            success_rate: share of its latest episodes in which the agent escaped, 0..1.

        Returns:
            The next stage, this one or the one before; never beyond either end.

        Raises:
            InputError: if there is no such stage, or the rate is not in 0..1.
        """
        last = len(self.stages) - 1
        if not 0 <= stage <= last:
            raise InputError(f"the stages are 0 to {last}; there is no stage {stage}")
        if not 0 <= success_rate <= 1:
            raise InputError(f"a success rate lies in 0..1, not {success_rate:g}")
        step = int(success_rate >= self.promote_at) - int(success_rate < self.demote_at)
        return min(max(stage + step, 0), last)


def is_difficulty(spec: object) -> bool:
    """Whether a user's ``--graph`` means an interval of difficulty (rightly written or not) and not one graph."""
    return isinstance(spec, str) and spec.partition(":")[0] in QUANTITIES


def parse_difficulty(spec: str, drop_key: bool = False, max_rooms: int = MAX_GRID_ROOMS) -> Difficulty:
    """The interval that a text such as ``"hitting_time:20..30"`` or ``"expected_steps:100..200"`` means.

    Args:
        spec: a quantity, a colon, and two numbers with two dots between them.
        drop_key: whether keys can be dropped.
        max_rooms: graphs with more rooms are left out.

    Returns:
        The interval; `Difficulty.sample` draws a graph from it.

    Raises:
        InputError: if it is written otherwise, or no goal graph is that difficult.
    """
    match = _SPEC.fullmatch(spec.strip())
    if match is None or match["quantity"] not in QUANTITIES:
        raise InputError(f"a difficulty is written {' or '.join(q + ':LOW..HIGH' for q in QUANTITIES)}, not {spec!r}")
    return Difficulty(float(match["low"]), float(match["high"]), match["quantity"], drop_key, max_rooms)


@lru_cache
def graphs_by_difficulty(quantity: str, drop_key: bool, max_rooms: int) -> tuple[tuple[float, GoalGraph], ...]:
    """Every goal graph of 2 to ``max_rooms`` rooms, up to renaming, with its difficulty; the easiest first.

    Args:
        quantity: one of `QUANTITIES`.
        drop_key: whether keys can be dropped.
        max_rooms: most rooms of a graph; seven rooms and fewer make 328 graphs and take a second.

    Returns:
        (difficulty, graph) pairs.
    """
    graphs = [graph for n_rooms in range(2, max_rooms + 1) for graph in enumerate_graphs(n_rooms)]
    ranked = [(float(getattr(analyze(graph, drop_key), quantity)), graph) for graph in graphs]
    return tuple(sorted(ranked, key=lambda pair: (pair[0], pair[1].key_rooms, pair[1].exit_room)))
