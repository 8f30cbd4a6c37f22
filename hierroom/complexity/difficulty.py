"""Goal graphs by difficulty: an interval, a curriculum along it, and the sampler of what N environments play."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.report import analyze
from hierroom.errors import InputError
from hierroom.goals import MAX_GRID_ROOMS, GoalGraph, as_goal_graph, enumerate_graphs

QUANTITIES = ("hitting_time", "expected_steps")
EPISODES_PER_STAGE = 200
"""Least number of episodes that must begin and end in a stage before the curriculum decides about the next stage."""
_SPEC = re.compile(r"(?P<quantity>\w+):(?P<low>\d+(?:\.\d+)?)\.\.(?P<high>\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Difficulty:
    """An interval of difficulty and the goal graphs in it.

    Args:
        low: smallest difficulty, included.
        high: largest difficulty, included.
        quantity: `"hitting_time"`, the paper's value, which saturates near 100 and therefore hardly separates the
            hardest graphs, or `"expected_steps"`, the true mean, which does not saturate.
        drop_key: whether keys can be dropped, which makes every graph harder.
        max_rooms: largest number of rooms of a graph, 2 to 7, which is the most that a grid can hold.

    Raises:
        InputError: if an argument is not valid, or no goal graph is in the interval.
    """

    low: float
    high: float
    quantity: str = "hitting_time"
    drop_key: bool = False
    max_rooms: int = MAX_GRID_ROOMS

    def __post_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InputError(f"difficulty must be measured by {' or '.join(QUANTITIES)}, not {self.quantity}")
        if not 0 <= self.low <= self.high < float("inf"):
            raise InputError(f"a difficulty interval must go from low to high, not from {self.low:g} to {self.high:g}")
        if not 2 <= self.max_rooms <= MAX_GRID_ROOMS:
            raise InputError(f"max_rooms must be from 2 to {MAX_GRID_ROOMS}, not {self.max_rooms}")
        if not self.graphs:
            values = [value for value, _ in graphs_by_difficulty(self.quantity, self.drop_key, self.max_rooms)]
            raise InputError(
                f"no goal graph of up to {self.max_rooms} rooms has a {self.quantity} in {self.low:g}..{self.high:g}; "
                f"the values go from {values[0]:.2f} to {values[-1]:.2f}"
            )

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """Every goal graph in the interval, up to renaming, the easiest first."""
        ranked = graphs_by_difficulty(self.quantity, self.drop_key, self.max_rooms)
        return tuple(graph for value, graph in ranked if self.low <= value <= self.high)

    def sample(self, rng: np.random.Generator) -> GoalGraph:
        """Sample one of `graphs` uniformly."""
        return self.graphs[int(rng.integers(len(self.graphs)))]


@dataclass(frozen=True)
class Curriculum:
    """Moves through an interval of difficulty depending on how often the agent escapes.

    The interval is divided into stages of equal width, and stages without a goal graph are omitted. The only state of a
    curriculum is the number of the current stage, which the caller keeps; this object is immutable.

    Args:
        difficulty: the whole interval.
        n_stages: number of parts into which it is divided, at least 1.
        promote_at: the next stage begins at this success rate or above.
        demote_at: the previous stage returns below this success rate; 0 <= demote_at < promote_at <= 1.

    Raises:
        InputError: if an argument is not valid.
    """

    difficulty: Difficulty
    n_stages: int = 5
    promote_at: float = 0.8
    demote_at: float = 0.2

    def __post_init__(self) -> None:
        if self.n_stages < 1:
            raise InputError(f"a curriculum needs at least one stage, not {self.n_stages}")
        if not 0 <= self.demote_at < self.promote_at <= 1:
            raise InputError(
                "a curriculum needs 0 <= demote_at < promote_at <= 1, "
                f"not demote_at {self.demote_at:g} and promote_at {self.promote_at:g}"
            )

    @property
    def stages(self) -> tuple[Difficulty, ...]:
        """The stages in order; together they contain every graph of the interval exactly once."""
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
        """Return the stage that follows.

        Args:
            stage: the current stage, 0 to ``len(stages) - 1``; a curriculum begins at 0.
            success_rate: fraction of its most recent episodes in which the agent escaped, 0..1.

        Returns:
            The next, the current or the previous stage, limited to the stages that exist.

        Raises:
            InputError: if there is no such stage, or the rate is not in 0..1.
        """
        last = len(self.stages) - 1
        if not 0 <= stage <= last:
            raise InputError(f"the stages are 0 to {last}; there is no stage {stage}")
        if not 0 <= success_rate <= 1:
            raise InputError(f"a success rate must be in 0..1, not {success_rate:g}")
        step = int(success_rate >= self.promote_at) - int(success_rate < self.demote_at)
        return min(max(stage + step, 0), last)


def is_difficulty(spec: object) -> bool:
    """Whether a user's ``--graph`` means an interval of difficulty, even a malformed one, and not one graph."""
    return isinstance(spec, str) and spec.partition(":")[0] in QUANTITIES


def parse_difficulty(spec: str, drop_key: bool = False, max_rooms: int = MAX_GRID_ROOMS) -> Difficulty:
    """Parse an interval such as ``"hitting_time:20..30"`` or ``"expected_steps:100..200"``.

    Args:
        spec: a quantity, a colon, and two numbers with two dots in between.
        drop_key: whether keys can be dropped.
        max_rooms: largest number of rooms of a graph.

    Returns:
        The interval; `Difficulty.sample` samples a graph from it.

    Raises:
        InputError: if the text has another form, or no goal graph is in the interval.
    """
    match = _SPEC.fullmatch(spec.strip())
    if match is None or match["quantity"] not in QUANTITIES:
        raise InputError(f"a difficulty must be {' or '.join(q + ':LOW..HIGH' for q in QUANTITIES)}, not {spec!r}")
    return Difficulty(float(match["low"]), float(match["high"]), match["quantity"], drop_key, max_rooms)


@lru_cache
def graphs_by_difficulty(quantity: str, drop_key: bool, max_rooms: int) -> tuple[tuple[float, GoalGraph], ...]:
    """List every goal graph of 2 to ``max_rooms`` rooms, up to renaming, with its difficulty, the easiest first.

    Args:
        quantity: one of `QUANTITIES`.
        drop_key: whether keys can be dropped.
        max_rooms: largest number of rooms of a graph; up to seven rooms there are 328 graphs, which take a second.

    Returns:
        (difficulty, graph) pairs.
    """
    graphs = [graph for n_rooms in range(2, max_rooms + 1) for graph in enumerate_graphs(n_rooms)]
    ranked = [(float(getattr(analyze(graph, drop_key), quantity)), graph) for graph in graphs]
    return tuple(sorted(ranked, key=lambda pair: (pair[0], pair[1].key_rooms, pair[1].exit_room)))


class GraphSampler:
    """The goal graphs of N environments: one graph, or those of a difficulty, all at once or stage by stage.

    Args:
        graph: a letter, a `GoalGraph`, a path to a TOML file, or ``hitting_time:LOW..HIGH`` (see `parse_difficulty`).
        drop_key: whether keys can be dropped, which makes every graph harder.
        num_envs: number of environments N that sample from these graphs.
        n_stages: number of stages of the `Curriculum` into which a difficulty is divided, at least 1.

    Attributes:
        everything: all graphs that may ever be sampled, the easiest first.

    Raises:
        InputError: if there is no such graph, or a single graph is given with several stages.
    """

    def __init__(self, graph: GoalGraph | str | Path, drop_key: bool, num_envs: int, n_stages: int = 1):
        self.everything: tuple[GoalGraph, ...]
        self._curriculum: Curriculum | None = None
        if isinstance(graph, str) and is_difficulty(graph):
            self._curriculum = Curriculum(parse_difficulty(graph, drop_key), n_stages)
            self.everything = self._curriculum.difficulty.graphs
        elif n_stages != 1:
            raise InputError(f"a curriculum of {n_stages} stages needs a graph like hitting_time:20..30, not {graph!r}")
        else:
            self.everything = (as_goal_graph(graph),)
        self._counts = np.zeros(3, np.int64)  # the stage, and the number of its episodes and successes so far
        self._is_older = np.zeros(num_envs, bool)  # whether the current episode began in another stage

    @property
    def stage(self) -> int:
        """The current stage of the curriculum, counted from 0."""
        return int(self._counts[0])

    @property
    def n_stages(self) -> int:
        """How many stages there are: 1 where there is no curriculum."""
        return 1 if self._curriculum is None else len(self._curriculum.stages)

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """The graphs to sample from in the current stage."""
        return self.everything if self._curriculum is None else self._curriculum.stages[self.stage].graphs

    def add(self, ended: NDArray[np.bool_], escaped: NDArray[np.bool_]) -> bool:
        """Count the episodes of the current stage that a step ended, and change the stage if it is time.

        Args:
            ended: [N] bool, whether the episode ended.
            escaped: [N] bool, whether it ended at the exit.

        Returns:
            Whether `graphs` has changed.
        """
        if self._curriculum is None:
            return False
        self._counts[1:] += (ended & ~self._is_older).sum(), (escaped & ~self._is_older).sum()
        self._is_older &= ~ended
        before, n_episodes, n_successes = self._counts.tolist()
        if n_episodes < EPISODES_PER_STAGE:
            return False
        stage = self._curriculum.advance(before, n_successes / n_episodes)
        self._counts[:] = stage, 0, 0
        if stage == before:
            return False
        self._is_older[:] = True  # also where this step began a new episode, whose graph is already sampled
        return True

    def reset(self) -> None:
        """Note that episodes of the current stage begin in every environment."""
        self._is_older[:] = False

    def get_state(self) -> dict[str, NDArray]:
        """The state of the curriculum as new arrays."""
        return {"curriculum": self._counts.copy(), "is_older": self._is_older.copy()}

    def check_state(self, state: Mapping[str, NDArray]) -> None:
        """Check a state before `set_state`.

        Raises:
            InputError: if there is no such stage.
        """
        if not 0 <= state["curriculum"][0] < self.n_stages:
            raise InputError(f"the stages are 0 to {self.n_stages - 1}; there is no stage {state['curriculum'][0]}")

    def set_state(self, state: Mapping[str, NDArray]) -> None:
        """Restore what `get_state` returned, after `check_state`."""
        self.check_state(state)
        self._counts[:], self._is_older[:] = state["curriculum"], state["is_older"]
