"""The EscapeRoom as a world: its goals, goal graphs and their curriculum, features, observations and states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.goals import (
    EXIT_GOAL,
    GOAL_NAMES,
    GOAL_VECTORS,
    N_COLOURS,
    N_GOALS,
    ROOM_GOAL_NAMES,
    GoalGraph,
    room_goals,
)
from hierroom.goals.goal_set import GoalSet
from hierroom.support.arrays import freeze
from hierroom.worlds.base import BaseWorld
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, EnvConfig
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.features import FEATURES
from hierroom.worlds.escape_room.graph_sampler import GraphSampler
from hierroom.worlds.escape_room.layout import NO_MAPS, State, map_arrays
from hierroom.worlds.escape_room.level_view import OBSERVATION_SPACES, LevelView, legal_goals
from hierroom.worlds.escape_room.observations import LevelWriter, write_one
from hierroom.worlds.escape_room.oracle import shortest_actions, shortest_lengths
from hierroom.worlds.escape_room.render import LevelReplayer
from hierroom.worlds.seeds import chosen_envs
from hierroom.worlds.world import Replayer, Seeds

GOALS = GoalSet(
    GOAL_NAMES,
    GOAL_VECTORS,
    EXIT_GOAL,
    ("key", "door", "exit"),
    np.arange(N_GOALS) // N_COLOURS,
    ROOM_GOAL_NAMES,
    n_alike=N_COLOURS,
)


class EscapeRoomWorld(Engine, BaseWorld):
    """N EscapeRooms with goal graphs that a curriculum may choose; see `Engine` for the settings."""

    goals = GOALS
    features = FEATURES
    replayer: Replayer = LevelReplayer()
    observation_spaces = OBSERVATION_SPACES
    is_repeatable = False

    def __init__(self, config: EnvConfig, num_envs: int, *, autoreset: bool = True, **settings: Any) -> None:
        graphs = config.graph, config.exclude, config.drop_key, num_envs, config.curriculum_stages
        self.sampler = GraphSampler(*graphs, tuple(one.graph for one in config.layout))
        super().__init__(
            self.sampler.graphs,
            num_envs,
            size=config.size,
            max_steps=config.max_steps or DEFAULT_MAX_STEPS,
            drop_key=config.drop_key,
            first_index=config.env_index,
            levels=config.levels,
            maps=map_arrays(config.layout, config.size) if config.layout else NO_MAPS,
            **settings,
        )
        self.config = config
        self.everywhere: NDArray[np.integer] = np.arange(num_envs)
        self.everywhere.setflags(write=False)
        self.rules: GoalGraph | None = self.sampler.everything[-1]
        self.variants = tuple(dict.fromkeys(graph.name for graph in self.sampler.everything))
        self.stage_titles: Sequence[str] = self.sampler.stage_titles
        self.can_split = self.sampler.n_stages == 1
        # Arrows move, tab picks up, space opens, shift drops.
        keys = ("K_UP", "K_LEFT", "K_RIGHT", "K_TAB", "K_SPACE", "K_LSHIFT")
        self.keys_to_action: Mapping[str, int] = dict(zip(keys, range(self.n_actions), strict=False))
        self._advance = self.advance if autoreset else self.advance_within_episode
        # The caller of a step checks the actions.
        self.step = self._advance if self.can_split else self._step_in_stages  # pyright: ignore
        self._last_levels = self._finals if autoreset else self._state.levels

    @property
    def stage(self) -> int:
        """The current stage of the curriculum, counted from 0."""
        return self.sampler.stage

    @property
    def complexity(self) -> ComplexityReport:
        """Measure how hard the environments are to explore, by the hardest goal graph if there are several."""
        return analyze(self.sampler.everything[-1], drop_key=self.n_actions == 6)

    def reset(self, seed: Seeds = None, envs: Any = slice(None)) -> None:
        """Begin an episode: see `Engine.reset`. A curriculum stays in its stage; within it a seed determines levels."""
        super().reset(seed, envs)
        self.sampler.reset(envs)

    def _step_in_stages(self, actions: NDArray[np.int64]) -> np.ndarray:
        had_ended = self._state.levels["has_ended"].copy()
        outcomes = self._advance(actions)
        escaped, truncated = outcomes["terminated"] & ~had_ended, outcomes["truncated"] & ~had_ended
        if self.sampler.add(escaped | truncated, escaped):
            self.set_graphs(self.sampler.graphs)
        return outcomes

    def observe(self, envs: NDArray[np.integer]) -> LevelView:
        """Return the view of environments [M], in read-only copies."""
        return freeze(LevelView(self._outcomes["tiles"][envs], self._state.levels.take(envs), self._state.maps))

    def last_view(self, envs: NDArray[np.integer], ended: NDArray[np.bool_]) -> LevelView:
        """Return the view of environments [M] after the last step, and before the reset where they ``ended`` [M]."""
        if ended.all():
            last = self._outcomes["final_tiles"][envs], self._last_levels.take(envs)
            return freeze(LevelView(*last, self._state.maps))
        tiles, levels = self._outcomes["tiles"][envs], self._state.levels.take(envs)
        tiles[ended], levels[ended] = self._outcomes["final_tiles"][envs[ended]], self._last_levels.take(envs[ended])
        return freeze(LevelView(tiles, levels, self._state.maps))

    def exact_view(self, envs: NDArray[np.integer]) -> LevelView:
        """Return the view of environments [M] and their exact state, in read-only copies."""
        tiles, levels, grids = self._outcomes["tiles"][envs], self._state.levels.take(envs), self._state.grids[envs]
        return freeze(LevelView(tiles, levels, self._state.maps, grids))

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_], view: LevelView | None = None) -> NDArray[np.bool_]:
        """Return the meta-controllers' legal choices [M, 14], in a view or everywhere; only 'no goal' off turn."""
        return legal_goals(self.state.levels if view is None else view.levels, mask, are_turns)

    def shortest_lengths(self, envs: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the fewest steps [M] from the current state to the exit in environments [M]."""
        return shortest_lengths(self._state, envs=chosen_envs(envs, len(self)))

    def shortest_actions(self, env: int) -> NDArray[np.integer]:
        """Return the actions of a shortest path to the exit in one environment."""
        return shortest_actions(self.get_state(env))

    def clocks(self) -> NDArray[np.integer]:
        """Return the steps [N] of the current episodes, in a new read-only array."""
        return freeze(self._state.levels["steps"].copy())

    def variants_of(self, envs: NDArray[np.integer]) -> list[str]:
        """Return the names of the goal graphs of the episodes that ended last in environments [M]."""
        return [graph.name for graph in self.sampler.graphs_of(self._last_levels[envs])]

    def milestones_of(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return goals [M] by room instead of colour, in the episodes that ended last in environments [M]."""
        return room_goals(goals, self._last_levels["branches"][envs])

    def possible_milestones(self, variants: Sequence[str]) -> list[int]:
        """Return the milestones that levels of these goal graphs have."""
        named = set(variants)
        n_rooms = max(graph.n_rooms for graph in self.sampler.everything if graph.name in named)
        return [c for c in range(N_GOALS) if c == EXIT_GOAL or c % N_COLOURS < n_rooms - 1]

    def graph_of(self, start: State) -> GoalGraph:
        """Return the goal graph of a level in the form in which it was given."""
        return self.sampler.graphs_of(start.levels)[0]

    def observe_one(self, goal: int) -> dict[str, Any]:
        """Return the observation of the only environment and the vector of a goal, in new arrays."""
        return write_one(self.outcomes, self.state.levels, goal)

    def batch_observations(self) -> LevelWriter:
        """Return the writer of the observations of all environments."""
        return LevelWriter(self)

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays."""
        state = self.get_state(envs)
        return {**self.sampler.get_state(envs), "grids": state.grids, "levels": state.levels}

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays that `get_arrays` of as many environments of the same size returned."""
        state = State(arrays["grids"], arrays["levels"], self._state.maps)
        self.check_state(state)
        self.sampler.set_state(arrays, state.levels)
        self._put(state, np.arange(len(self)))
        self.set_graphs(self.sampler.graphs)
