"""The sampler of the goal graphs that N environments play."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.graph_set import Curriculum, find_graphs
from hierroom.goals import GoalGraph, GraphSpecs
from hierroom.support.errors import InputError
from hierroom.support.schema import Array

EPISODES_PER_STAGE = 200
"""Least number of episodes of a stage on which the curriculum bases a decision."""


class GraphSampler:
    """The goal graphs of N environments: one graph, or a set of them, together or stage by stage.

    The curriculum bases a decision on equally many episodes of each environment, the first after its last decision. It
    waits until all of them have ended, because escapes end early and would count too often.

    Args:
        graph: the graphs, in the forms of `find_graphs`, without those of ``exclude``.
        n_stages: stages of the `Curriculum` into which the set is divided.
        of_maps: the graphs of fixed levels in order, to use instead of ``graph``.

    Attributes:
        everything: all graphs that may ever be sampled, the easiest first.
    """

    def __init__(
        self,
        graph: GraphSpecs,
        exclude: GraphSpecs,
        drop_key: bool,
        num_envs: int,
        n_stages: int = 1,
        of_maps: tuple[GoalGraph, ...] = (),
    ):
        chosen = find_graphs(of_maps or graph, exclude, drop_key)
        if len(chosen.graphs) == 1 and n_stages != 1:
            name = chosen.graphs[0].name
            raise InputError(f"a curriculum of {n_stages} stages needs several graphs, as of rooms:4, not {name} alone")
        self._curriculum, self._of_maps = Curriculum(chosen, n_stages), of_maps
        self.everything: tuple[GoalGraph, ...] = sum(self._curriculum.stages, ())
        if of_maps:
            ranks = {graph: n for n, graph in enumerate(self.everything)}  # equal graphs of other maps have other names
            self.everything = tuple(sorted(of_maps, key=ranks.__getitem__))
        self._known = {(graph.key_rooms, graph.exit_room): graph for graph in self.everything}
        self._quota = -(-EPISODES_PER_STAGE // num_envs)  # episodes of each environment in a decision
        self._counts = np.zeros(2, np.int64)  # the stage, and the successes that count so far
        self._n_ended = np.zeros(num_envs, np.int64)  # episodes that count so far; -1 before one begins

    @property
    def stage(self) -> int:
        """The current stage of the curriculum, counted from 0."""
        return int(self._counts[0])

    @property
    def n_stages(self) -> int:
        """Number of stages that have graphs."""
        return len(self._curriculum.stages)

    @property
    def stage_titles(self) -> list[str]:
        """A line for each stage of a curriculum, with its number of graphs and the first and last name."""
        stages = self._curriculum.stages if self.n_stages > 1 else ()
        return [
            f"stage {n} of {len(stages)}: {len(graphs)} graph{'s' * (len(graphs) > 1)}, "
            + (graphs[0].name if len(graphs) == 1 else f"{graphs[0].name} to {graphs[-1].name}")
            for n, graphs in enumerate(stages, start=1)
        ]

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """The graphs to sample from in the current stage."""
        return self._curriculum.stages[self.stage]

    def graphs_of(self, levels: np.ndarray) -> list[GoalGraph]:
        """Return the goal graphs, as they were given, of levels: [M] records of `layout.LEVEL`."""
        if self._of_maps:
            return [self._of_maps[number - 1] for number in levels["map"].tolist()]
        rooms = zip(levels["n_rooms"].tolist(), levels["key_rooms"].tolist(), levels["exit_room"].tolist(), strict=True)
        return [self._known[tuple(key_rooms[: n_rooms - 1]), exit_room] for n_rooms, key_rooms, exit_room in rooms]

    def add(self, ended: NDArray[np.bool_], escaped: NDArray[np.bool_]) -> bool:
        """Count the episodes that ended [N], and escaped [N], in a step; return whether `graphs` changes."""
        if self.n_stages == 1:
            return False
        self._counts[1] += (escaped & (self._n_ended >= 0) & (self._n_ended < self._quota)).sum()
        self._n_ended += ended & (self._n_ended < self._quota)
        if (self._n_ended < self._quota).any():
            return False
        before, n_successes = self._counts.tolist()
        stage = self._curriculum.advance(before, n_successes / self._n_ended.sum())
        self._counts[:] = stage, 0
        self._n_ended[:] = -1  # also where this step began an episode, because its graph is already sampled
        return stage != before

    def reset(self, envs: NDArray[np.integer] | slice = slice(None)) -> None:
        """Record that episodes of the current stage begin in some environments, by default in all."""
        self._n_ended[envs] = np.maximum(self._n_ended[envs], 0)

    def get_state(self, envs: NDArray[np.integer] | slice = slice(None)) -> dict[str, NDArray]:
        """Return the state of the curriculum as new arrays, of some environments or of all."""
        return {"curriculum": self._counts.copy(), "n_ended": self._n_ended[envs].copy()}

    def set_state(self, state: Mapping[str, NDArray], levels: np.ndarray) -> None:
        """Restore a state from `get_state`, after a check of it and of the levels of the environments."""
        Array(np.int64, (2,)).check(state["curriculum"], "curriculum")
        Array(np.int64, self._n_ended.shape).check(state["n_ended"], "n_ended")
        (stage, n_successes), n_ended = state["curriculum"].tolist(), state["n_ended"]
        if not 0 <= stage < self.n_stages:
            raise InputError(f"the stages are 0 to {self.n_stages - 1}; there is no stage {stage}")
        if not (-1 <= n_ended.min() < self._quota and n_ended.max() <= self._quota):
            raise InputError(f"n_ended must hold -1 to {self._quota} episodes, and fewer in one environment at least")
        if not 0 <= n_successes <= np.maximum(n_ended, 0).sum():
            raise InputError(f"curriculum must hold no more successes than episodes ended, not {n_successes}")
        try:
            self.graphs_of(levels)
        except KeyError as error:
            raise InputError(f"a level is of another goal graph than is sampled here: {error}") from None
        self._counts[:], self._n_ended[:] = state["curriculum"], state["n_ended"]
