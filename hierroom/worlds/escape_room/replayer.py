"""Replay episodes of an EscapeRoom from their start, name their goals and draw their states."""

from __future__ import annotations

from collections.abc import Container, Iterator

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, OPEN, PICKUP, RIGHT
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.level import goal_name, graph_of
from hierroom.worlds.escape_room.render import default_tile_size, draw_level, legible_tile_size, text

ACTION_NAMES = {FORWARD: "forward", LEFT: "left", RIGHT: "right", PICKUP: "pick up", OPEN: "open", DROP: "drop"}


class LevelReplayer:
    """The `Replayer` of EscapeRooms; a state is a `State` of one environment."""

    picture, text = staticmethod(draw_level), staticmethod(text)

    def identity(self, state: State) -> tuple[int, int, int]:
        """Return the environments' seed, this one's index, and the number of episodes that it began before."""
        level = state.levels[0]
        return int(level.seed), int(level.index), int(level.episode)

    def max_steps(self, state: State) -> int:
        """Return the number of steps after which the episode is truncated."""
        return int(state.levels[0].max_steps)

    def goal_name(self, state: State, goal: int) -> str:
        """Return the name of a goal in the level: see `level.goal_name`."""
        return goal_name(state.levels[0], goal)

    def goal_label(self, state: State, goal: int) -> str:
        """Return the name of a goal without its colour, which is drawn for each episode, such as ``"key 1"``."""
        name = self.goal_name(state, goal)
        colour, _, rest = name.partition(" ")
        return rest if colour in COLOURS else name

    def action_name(self, state: State, action: int) -> str:
        """Return the name of a controller's action."""
        return ACTION_NAMES[action] if action < DROP + bool(state.levels["can_drop"][0]) else "illegal action"

    def replay(
        self, state: State, actions: NDArray[np.integer], drawn: Container[int] | None = None
    ) -> Iterator[State]:
        """Yield the state, then the state after each action."""
        engine = Engine([graph_of(state.levels[0])], size=state.size, seed=None, maps=state.maps)
        engine.set_state(state)
        yield engine.get_state()
        for action in actions:
            engine.step_within_episode([action])
            yield engine.get_state()

    def tile_size(self, state: State) -> int:
        """Return a side length of a cell in pixels at which a line of text fits into the grid."""
        return legible_tile_size(state.size)

    def window_tile_size(self, state: State) -> int:
        """Return MiniGrid's side length of a cell in pixels, or less so that a large grid fits on a screen."""
        return default_tile_size(state.size)
