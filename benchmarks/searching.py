"""A controller that remembers all it saw, looks for its goals, and needs no training.

It sees what agents see, 7 x 7 cells and none behind a wall, but forgets nothing and knows the rules: it is about as
short as an agent with that view can be. By how much a controller that sees the whole level is shorter is the cost of
having to search.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, NO_GOAL
from hierroom.meta import MetaController, take_turn
from hierroom.support.errors import InputError
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room import constants, view_kernels
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    EMPTY,
    EXIT,
    KEY,
    LOCKED_DOOR,
    OPEN_DOOR,
    ROW_STEP,
    UNSEEN,
    VIEW,
)

# What an unseen cell may turn out to be, as tile codes that `view_kernels.look` tells apart and lets light pass.
IDLE, FAINT, HOPEFUL = EMPTY, EXIT, KEY
FAINT_WORTH = 0.25
"""Worth of seeing a faint cell, where a hopeful one is worth 1; if they were worth the same, episodes on all seven
graphs would be 4% longer. 0.1 and 0.5 do as well."""
PATIENCE = 6
"""Steps added to the length of every way before the worth of its view is divided by it. Without them near glimpses win
too often, and episodes are 4% longer; 5 and 8 do as well. To go for the nearest, whatever its worth, makes them 11%
longer."""
WANTED = KEY, LOCKED_DOOR, EXIT
"""The first tile code of each kind of goal: a key, a door, the exit."""
LAST_ACTION = constants.PICKUP, constants.OPEN, constants.FORWARD
"""The action that achieves it, in front of it."""

# The kernels are not cached on disk: Numba would not notice a change of the constants they take from the world's.


@njit
def remember(levels, views, known):
    """Copy what the views [N, 7, 7] show to where it is on the maps."""
    for n in range(levels.shape[0]):
        level, seen = levels[n], known[n]
        ahead_row, ahead_col = ROW_STEP[level.direction], COL_STEP[level.direction]
        for i in range(VIEW):
            for j in range(VIEW):
                right, ahead = i - VIEW // 2, VIEW - 1 - j
                row = level.row + ahead * ahead_row + right * ahead_col
                col = level.col + ahead * ahead_col - right * ahead_row
                if right == ahead == 0:  # where the view shows what is carried
                    seen[row, col] = max(seen[row, col], EMPTY)
                elif views[n, i, j] != UNSEEN:
                    seen[row, col] = views[n, i, j]


@njit
def survey(known, corner, is_done):
    """Return what is known of the room of a cell: rooms are rectangles, so a bit of a wall tells where all of it is.

    Args:
        known: the map.
        corner: (row, col) of a cell of seen floor.
        is_done: [rows, cols] bool; the room's seen floor is added to it.

    Returns:
        hull: the greatest col, greatest row, least col and least row of its seen floor, as directions are numbered.
        is_closed: whether that is where the room ends, in each direction.
        doors: bits of the colours of its open doors.
    """
    hull, is_closed, doors = np.array([corner[1], corner[0], corner[1], corner[0]]), np.zeros(4, np.bool_), 0
    is_done[corner] = True
    stack = [corner]
    while stack:
        row, col = stack.pop()
        hull[0], hull[1], hull[2], hull[3] = max(hull[0], col), max(hull[1], row), min(hull[2], col), min(hull[3], row)
        for direction in range(4):
            beside = row + ROW_STEP[direction], col + COL_STEP[direction]
            tile = known[beside]
            if tile >= OPEN_DOOR:
                is_closed[direction] = True
                doors |= (tile < LOCKED_DOOR) << (tile - OPEN_DOOR) % N_COLOURS
            elif tile != UNSEEN and not is_done[beside]:
                is_done[beside] = True
                stack.append(beside)
    return hull, is_closed, doors


@njit
def imagine(known, start, latest, kind, imagined):
    """Draw the map with the unseen cells that may hold a goal as faint or hopeful, others that may be floor as idle.

    A key may be in every room, the exit in every room but the centre. Hopeful are the cells of the room opened last, or
    of the centre before that: the goal is usually there. Doors are in the walls of the centre.

    Args:
        known: the map.
        start: (row, col) where the agent started, which is in the centre.
        latest: colour of the door opened last, or -1.
        kind: 0 for a key, 1 for a door, 2 for the exit.
        imagined: the map to draw.
    """
    side = known.shape[0]
    beyond = np.array([1, 1, -1, -1]) * (VIEW - 1)  # as far as one could see from there
    is_done = np.zeros(known.shape, np.bool_)
    for row in range(side):
        for col in range(side):
            tile = known[row, col]  # objects would be taken for hope
            imagined[row, col] = EMPTY if EMPTY < tile < OPEN_DOOR else tile
    for cell in range(-1, known.size):
        corner = start if cell < 0 else (cell // side, cell % side)
        if is_done[corner] or not EMPTY <= known[corner] < OPEN_DOOR:
            continue
        is_centre = cell < 0
        hull, is_closed, doors = survey(known, corner, is_done)
        is_latest = is_centre if latest < 0 else not is_centre and (doors >> latest) & 1 == 1
        what = HOPEFUL if is_latest else FAINT
        if kind > 0 and is_centre != (kind == 1):
            what = IDLE
        right, bottom, left, top = hull + np.where(is_closed, 0, beyond)
        wall = is_closed & (kind == 1 and is_centre)
        for row in range(top - wall[3], bottom + wall[1] + 1):
            for col in range(left - wall[2], right + wall[0] + 1):
                is_inside = hull[3] <= row <= hull[1] and hull[2] <= col <= hull[0]
                is_corner = not (left <= col <= right or top <= row <= bottom)
                if known[row, col] == UNSEEN and not is_corner:
                    here = IDLE if kind == 1 and is_inside else what
                    imagined[row, col] = max(imagined[row, col], here)


@njit
def find_ways(level, known):
    """Return the shortest ways over known cells to every pose, keys picked up where they lie in the way.

    A node is ``cell << 3 | direction << 1 | whether the key ahead was just picked up``.

    Returns:
        The nodes in order of distance, the distances, and the first action of each way (-1 where it has none); all
        int64.
    """
    side, cells = known.shape[1], known.reshape(-1)
    steps = (1, side, -1, -side)
    nodes, distances, actions = np.empty((3, 8 * known.size), np.int64)
    is_found = np.zeros(8 * known.size, np.bool_)
    nodes[0], distances[0], actions[0] = (level.row * side + level.col) << 3 | level.direction << 1, 0, -1
    is_found[nodes[0]] = True
    head, tail = 0, 1
    while head < tail:
        node = nodes[head]
        cell, direction, has_taken = node >> 3, (node >> 1) & 3, node & 1
        tile = cells[cell + steps[direction]]
        moves = [(constants.FORWARD, node)]  # to where it is, until there turns out to be more
        if has_taken or tile == EMPTY or OPEN_DOOR <= tile < LOCKED_DOOR:
            moves[0] = constants.FORWARD, (cell + steps[direction]) << 3 | direction << 1
        elif KEY <= tile < OPEN_DOOR:
            moves[0] = constants.PICKUP, node | 1
        if not has_taken:
            moves.append((constants.LEFT, cell << 3 | ((direction + 3) & 3) << 1))
            moves.append((constants.RIGHT, cell << 3 | ((direction + 1) & 3) << 1))
        for action, reached in moves:
            if not is_found[reached]:
                is_found[reached] = True
                nodes[tail], distances[tail] = reached, distances[head] + 1
                actions[tail] = action if head == 0 else actions[head]
                tail += 1
        head += 1
    return nodes[:tail], distances[:tail], actions[:tail]


@njit
def best_look(nodes, distances, imagined, agent):
    """Return the index of the way that shows most per step; -1 if nothing is left to be seen.

    As the agent nears that pose, its worth a step grows; so it is reached, unless something better comes into view.
    """
    side = imagined.shape[1]
    view = np.empty((VIEW, VIEW), np.uint8)
    best, most = -1, 0.0
    for place in range(nodes.size):
        if nodes[place] & 1 == 0:  # else the same cell and direction as before the pick-up
            cell = nodes[place] >> 3
            agent.row, agent.col, agent.direction = cell // side, cell % side, (nodes[place] >> 1) & 3
            view_kernels.look(agent, imagined, view)
            worth = 0.0
            for tile in view.flat:
                worth += (tile == HOPEFUL) + FAINT_WORTH * (tile == FAINT)
            worth /= distances[place] + PATIENCE
            if worth > most:
                best, most = place, worth
    return best


@njit
def choose(level, known, start, latest, goal):
    """Return the first action on the shortest way to a goal that was seen, else to where most can be seen per step."""
    side = known.shape[1]
    steps = (1, side, -1, -side)
    kind = goal // N_COLOURS
    nodes, distances, actions = find_ways(level, known)
    wanted = WANTED[kind] + goal % N_COLOURS
    if (known == wanted).any():
        for place in range(nodes.size):
            if known.flat[(nodes[place] >> 3) + steps[(nodes[place] >> 1) & 3]] == wanted:
                return actions[place] if place else LAST_ACTION[kind]
    imagined = np.empty_like(known)
    imagine(known, start, latest, kind, imagined)
    place = best_look(nodes, distances, imagined, level)
    return actions[place] if place > 0 else constants.LEFT  # no more to see: it is out of reach, and time runs out


@njit
def choose_all(levels, known, starts, latest, goals, actions):
    """Write what to do in every environment; the records of the levels are overwritten."""
    for n in range(levels.shape[0]):
        actions[n] = choose(levels[n], known[n], (starts[n, 0], starts[n, 1]), latest[n], goals[n])


class Searching:
    """Goes the shortest way to each goal that it saw this episode, and looks for those it did not see.

    Of a level it reads the agent's cell and direction, and what the view shows. It plans anew before every step.

    Args:
        meta: gives the goals; only such that can be reached.
        turns: the environments it will play in.
    """

    def __init__(self, meta: MetaController, turns: Turns) -> None:
        self._meta = meta
        self._known = np.zeros_like(turns.world.state.grids)  # tile codes of cells seen this episode, else UNSEEN
        self._starts = np.zeros((len(turns), 2), np.int64)  # (row, col)
        self._latest = np.zeros(len(turns), np.int64)  # colour of the door opened last, or -1
        self._begin(turns, np.arange(len(turns)))

    def _begin(self, turns: Turns, envs: NDArray[np.integer]) -> None:
        levels = turns.world.state.levels[envs]
        self._known[envs], self._latest[envs] = UNSEEN, -1
        self._starts[envs] = np.stack((levels["row"], levels["col"]), axis=1)

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment.

        Raises:
            InputError: if an environment has no goal.
        """
        take_turn(self._meta, turns)
        if (turns.goals == NO_GOAL).any():
            raise InputError("the searching controller needs a meta-controller that always gives a goal")
        actions = np.empty(len(turns), np.int64)
        levels = turns.world.state.levels
        remember(levels, turns.world.outcomes["tiles"], self._known)
        agents = np.zeros_like(levels)  # where they are, and nothing else that the levels' records hold
        for name in ("row", "col", "direction"):
            agents[name] = levels[name]
        agents["carried"] = -1  # else it would be seen on their cells
        choose_all(agents, self._known, self._starts, self._latest, turns.goals.astype(np.int64), actions)
        step = turns.step(actions)
        has_opened = (step.events >= FIRST_DOOR_GOAL) & (step.events < EXIT_GOAL)
        self._latest[has_opened] = step.events[has_opened] - FIRST_DOOR_GOAL
        self._begin(turns, np.flatnonzero(step.episode_ended))
        return step
