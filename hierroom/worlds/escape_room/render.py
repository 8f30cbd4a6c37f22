"""Render a level as a picture and as text, and replay episodes; only pictures import MiniGrid."""

from __future__ import annotations

from collections.abc import Container, Iterator
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, NO_GOAL
from hierroom.support.errors import InputError
from hierroom.support.schema import Whole
from hierroom.worlds.escape_room import batch_kernels
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    DROP,
    EXIT,
    FORWARD,
    KEY,
    LEFT,
    LOCKED_DOOR,
    MARGIN,
    N_TILES,
    OPEN,
    OPEN_DOOR,
    PICKUP,
    RIGHT,
    ROW_STEP,
    UNSEEN,
    VIEW,
    WALL,
)
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import OUTCOME, State
from hierroom.worlds.escape_room.level import goal_name, graph_of

OUTLINE = (255, 255, 255)
CAPTION_INK, CAPTION_PAPER = (255, 255, 255), (20, 20, 20)
TERMINAL_COLOURS = (91, 92, 94, 95, 93, 37)  # ANSI foreground codes of `COLOURS`


def legible_tile_size(size: int) -> int:
    """Return an even side length of a cell in pixels at which text fits into a grid of ``size`` cells a side."""
    tile_size = max(-(-304 // size), min(16, 800 // size))
    return tile_size + tile_size % 2


def draw_level(state: State, goal: int = NO_GOAL, tile_size: int = 32, title: str = "") -> NDArray[np.uint8]:
    """Draw one level as MiniGrid does, with the agent's view highlighted: [H, W, 3] uint8.

    The cell of ``goal`` is outlined. The goal's name is written over the lower outer wall, ``title`` over the upper.
    """
    from minigrid.core.grid import Grid

    _check(state, goal)
    Whole(1).check(tile_size, "tile_size")
    tiles, level, size = _tiles(state), state.levels[0], state.size
    is_seen = seen_cells(state)
    agent = level.row - MARGIN, level.col - MARGIN
    frame = np.empty((size, tile_size, size, tile_size, 3), np.uint8)
    for row, col in np.ndindex(size, size):
        direction = int(level.direction) if (row, col) == agent else None
        thing, seen = minigrid_objects()[int(tiles[row, col])], bool(is_seen[row, col])
        frame[row, :, col] = Grid.render_tile(thing, direction, seen, int(tile_size))  # MiniGrid caches it
    for row, col in cells_of(goal, tiles):
        cell, width = frame[row, :, col], max(1, tile_size // 10)
        for edge in (cell[:width], cell[-width:], cell[:, :width], cell[:, -width:]):
            edge[:] = OUTLINE
    frame = frame.reshape(size * tile_size, size * tile_size, 3)
    if goal != NO_GOAL:
        frame[-tile_size:] = _caption(f"subgoal: {goal_name(level, goal)}", tile_size, size * tile_size)
    if title:
        frame[:tile_size] = _caption(title, tile_size, size * tile_size)
    return frame


def text(state: State, goal: int = NO_GOAL) -> str:
    """Render one level as coloured text with two characters per cell, and below it its rooms, agent and subgoal.

    The agent is ``>>``, ``vv``, ``<<`` or ``^^``, a key ``k``, a locked door ``D``, an open door ``d``, each with the
    initial of its colour (``w`` for grey), and the exit is ``EX``.
    """
    _check(state, goal)
    tiles, level = _tiles(state), state.levels[0]
    lines = []
    for row, tiles_in_row in enumerate(tiles):
        cells = [_characters(int(tile)) for tile in tiles_in_row]
        if row == level.row - MARGIN:
            cells[level.col - MARGIN] = _in_colour((">>", "vv", "<<", "^^")[level.direction], 0)
        lines.append("".join(cells))
    colours = level.colours[: level.n_rooms - 1].tolist()
    held = [goal_name(level, colour) for branch, colour in enumerate(colours) if (level.keys >> branch) & 1]
    rooms = ", ".join(f"{COLOURS[colour]} {room}" for room, colour in enumerate(colours, start=1))
    lines.append(f"keys and doors: {rooms}; the exit is in room {level.exit_room}")
    lines.append(f"step {level.steps} of {level.max_steps}, keys held: {', '.join(held) or 'none'}")
    if goal != NO_GOAL:
        lines.append(f"subgoal: {goal_name(level, goal)}")
    return "\n".join(lines)


def _check(state: State, goal: int) -> None:
    if len(state) != 1:
        raise InputError(f"a picture shows one environment, but the state holds {len(state)}: index the state first")
    if not isinstance(goal, (int, np.integer)) or not NO_GOAL <= goal <= EXIT_GOAL:
        raise InputError(f"a goal must be a whole number from 0 to {EXIT_GOAL}, or {NO_GOAL} for none, not {goal!r}")


def _tiles(state: State) -> NDArray[np.uint8]:
    return state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN]


def view_of(state: State) -> NDArray[np.uint8]:
    """Return the tile codes [7, 7] in the agent's view, by column from left to right and row from far to near."""
    scratch, outcomes = state.copy(), np.zeros(1, OUTCOME)  # on a copy, because looking updates the level's memories
    batch_kernels.look_levels(scratch.levels, scratch.grids, outcomes, np.zeros(1, np.int64))
    return outcomes["tiles"][0]


def seen_cells(state: State) -> NDArray[np.bool_]:
    """Return which cells of the grid [size, size] are in the agent's view."""
    level = state.levels[0]
    ahead = ROW_STEP[level.direction], COL_STEP[level.direction]
    right = ROW_STEP[(level.direction + 1) % 4], COL_STEP[(level.direction + 1) % 4]
    i, j = np.nonzero(view_of(state) != UNSEEN)
    is_seen = np.zeros(state.grids.shape[1:], bool)
    rows = level.row + (VIEW - 1 - j) * ahead[0] + (i - VIEW // 2) * right[0]
    cols = level.col + (VIEW - 1 - j) * ahead[1] + (i - VIEW // 2) * right[1]
    is_seen[rows, cols] = True
    return is_seen[MARGIN:-MARGIN, MARGIN:-MARGIN]


def cells_of(goal: int, tiles: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Return the cell of a goal, [0 or 1, 2] as (row, col); a held key has none."""
    if goal == NO_GOAL:
        codes = []
    elif goal == EXIT_GOAL:
        codes = [EXIT]
    elif goal >= FIRST_DOOR_GOAL:
        codes = [LOCKED_DOOR + goal - FIRST_DOOR_GOAL, OPEN_DOOR + goal - FIRST_DOOR_GOAL]
    else:
        codes = [KEY + goal]
    return np.argwhere(np.isin(tiles, codes))


@cache
def minigrid_objects() -> list:
    """Return MiniGrid's object for each tile code, None for empty and unseen cells."""
    from minigrid.core.world_object import Door, Goal, Key, Wall

    objects: list = [None] * N_TILES
    objects[EXIT], objects[WALL] = Goal(), Wall()
    for colour, name in enumerate(COLOURS):
        objects[KEY + colour] = Key(name)
        objects[OPEN_DOOR + colour] = Door(name, is_open=True)
        objects[LOCKED_DOOR + colour] = Door(name, is_locked=True)
    return objects


@lru_cache(maxsize=64)
def _caption(words: str, height: int, width: int) -> NDArray[np.uint8]:
    from PIL import Image, ImageDraw, ImageFont

    strip = Image.new("RGB", (width, height), CAPTION_PAPER)
    font = ImageFont.load_default(size=max(round(0.6 * height), min(height, 11)))
    ImageDraw.Draw(strip).text((width / 2, height / 2), words, fill=CAPTION_INK, font=font, anchor="mm")
    return np.asarray(strip)


def _in_colour(characters: str, colour: int) -> str:
    return f"\x1b[1;{TERMINAL_COLOURS[colour]}m{characters}\x1b[0m"


def _characters(tile: int) -> str:
    for first, letter in ((LOCKED_DOOR, "D"), (OPEN_DOOR, "d"), (KEY, "k")):
        if first <= tile < first + len(COLOURS):
            return _in_colour(letter + "rgbpyw"[tile - first], tile - first)
    if tile == EXIT:
        return _in_colour("EX", COLOURS.index("green"))
    return "██" if tile == WALL else "  "


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
        return max(8, min(32, 800 // state.size))
