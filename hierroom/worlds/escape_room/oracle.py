"""The shortest solution of a level, to which agents are compared.

A breadth-first search over (cell, direction, keys collected, doors opened) starts from the current state of the level.
It is exact although it ignores three things:

- **Dropping a key.** A key in hand blocks no cell and opens its door; a key on a cell blocks it. So everything that is
  possible after a drop is possible without it, one step sooner.
- **Doors that need not be opened, and rooms that hold nothing needed.** Every branch room has one door, to the centre
  or, in the level of a map, to a room on the way there. A path that enters such a room and returns ends in the doorway
  where it began, so it is no shorter than staying outside. The doors that must be opened form one chain: the goal's
  room, the room that holds its key, and so on to a key in reach. An agent with a key has passed all rooms on the way to
  the key's door (`map_rooms.read_rooms`).
- **The step limit.** Solutions may be longer than the rest of the episode.

Keys that are not needed do matter: they block cells, and picking one up may be shorter than walking around it.

States must be valid for `Engine.set_state`, because the search reads the record of a level and not its grid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.goals import EXIT_GOAL, N_COLOURS, N_GOALS
from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled, njit
from hierroom.support.schema import Whole
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, State
from hierroom.worlds.escape_room.level import goal_name
from hierroom.worlds.escape_room.rooms import room_at

# The kind of a goal: ``kind = goal // N_COLOURS``.
A_DOOR, THE_EXIT = 1, 2
# The actions in the search's own numbering, which `ACTIONS` translates.
GO, TURN_LEFT, TURN_RIGHT, TAKE, UNLOCK = range(5)
# Codes of the terrain: free, blocked, FIRST_KEY + slot of a key, or FIRST_DOOR + position of a door in the chain.
BLOCKED, FREE, FIRST_KEY, FIRST_DOOR = 0, 1, 2, 8

ACTIONS = np.array([constants.FORWARD, constants.LEFT, constants.RIGHT, constants.PICKUP, constants.OPEN])


@njit(cache=True)
def need(level, is_needed, room):
    """Mark a room as needed, and all rooms between it and the first one."""
    while not is_needed[room]:
        is_needed[room] = True
        room = level.door_rooms[room - 1]


@njit(cache=True)
def survey(level, rooms, side, kind, colour):
    """Prepare the search for a goal, in a grid of ``side`` cells a side, margins included.

    Returns:
        target: cell of the goal, -1 if the goal is achieved already, or -2 if it cannot be achieved.
        terrain: [cells] uint8, in which the cells that the search may ignore are blocked.
        n_keys: number of keys in the terrain, with slots 0, 1, ...
        needs: [doors in the chain] the bit of the key that each door needs, in the order of opening; 0 if it is held.
    """
    terrain = np.zeros(side * side, np.uint8)
    key_cells = np.full(6, -1, np.int64)
    for other in range(level.n_rooms - 1):
        if not (level.keys >> other) & 1:
            key_cells[other] = level.keys_at[other, 0] * side + level.keys_at[other, 1]
    exit_cell = level.exit_at[0] * side + level.exit_at[1]
    agent = level.row * side + level.col
    branch = level.branches[colour]
    exists = kind == THE_EXIT or branch < level.n_rooms - 1
    if kind == THE_EXIT:
        target, goal_room, is_achieved = exit_cell, level.exit_room, agent == exit_cell
    elif kind == A_DOOR:
        door = level.doors_at[branch]
        target, goal_room, is_achieved = door[0] * side + door[1], branch + 1, (level.doors >> branch) & 1 == 1
    else:
        target, is_achieved = key_cells[branch], key_cells[branch] < 0
        goal_room = 0 if is_achieved else room_at(level, rooms, target // side, target % side)
    if not exists or (agent == exit_cell and kind != THE_EXIT):
        return -2, terrain, 0, key_cells[:0]
    if is_achieved:
        return -1, terrain, 0, key_cells[:0]

    # The chain of doors, the last one to be opened first, and the rooms that must be entered.
    is_needed = np.zeros(level.n_rooms, np.bool_)
    is_needed[0] = True
    agent_room = room_at(level, rooms, level.row, level.col)
    need(level, is_needed, max(agent_room, 0))
    for other in range(level.n_rooms - 1):
        if agent_room < 0 and level.doors_at[other, 0] == level.row and level.doors_at[other, 1] == level.col:
            need(level, is_needed, level.door_rooms[other])
    chain = np.empty(6, np.int64)
    n_doors, r = 0, goal_room
    while r > 0 and n_doors < 6:
        need(level, is_needed, r)
        if (level.doors >> (r - 1)) & 1:
            break
        chain[n_doors] = r - 1
        n_doors += 1
        key_cell = key_cells[r - 1]
        r = 0 if key_cell < 0 else room_at(level, rooms, key_cell // side, key_cell % side)

    terrain[agent] = FREE
    key_bits = np.zeros(6, np.int64)
    n_keys = 0
    for row in range(MARGIN + 1, side - MARGIN - 1):
        for col in range(MARGIN + 1, side - MARGIN - 1):
            room = room_at(level, rooms, row, col)
            if room >= 0 and is_needed[room]:
                terrain[row * side + col] = FREE
    for r in range(1, level.n_rooms):
        if is_needed[r]:
            terrain[level.doors_at[r - 1, 0] * side + level.doors_at[r - 1, 1]] = FREE
    for other in range(level.n_rooms - 1):
        if key_cells[other] >= 0 and terrain[key_cells[other]] == FREE:
            terrain[key_cells[other]] = FIRST_KEY + n_keys
            key_bits[other] = 1 << n_keys
            n_keys += 1
    terrain[exit_cell] = BLOCKED
    needs = np.empty(n_doors, np.int64)
    for place in range(n_doors):
        door_branch = chain[n_doors - 1 - place]
        needs[place] = key_bits[door_branch]
        terrain[level.doors_at[door_branch, 0] * side + level.doors_at[door_branch, 1]] = FIRST_DOOR + place
    return target, terrain, n_keys, needs


@njit(cache=True, nogil=True)
def solve(level, rooms, side, kind, colour):
    """Find the fewest actions that achieve a goal.

    A node is ``layer << layer_shift | cell << 2 | direction``, its layer ``doors opened << n_keys | keys taken``.

    Returns:
        The actions in the search's numbering, and their number: 0 if the goal is achieved already, -1 if it cannot be.
    """
    target, terrain, n_keys, needs = survey(level, rooms, side, kind, colour)
    if target < 0:
        return needs[:0], target + 1
    layer_shift = 2
    while (1 << layer_shift) < 4 * side * side:
        layer_shift += 1
    n_nodes = ((needs.size + 1) << n_keys) << layer_shift
    cell_mask = (1 << (layer_shift - 2)) - 1
    reached_by = np.zeros(n_nodes, np.uint8)  # one more than the action that first reached the node
    queue = np.empty(n_nodes + 1, np.int32)
    parents = np.empty(n_nodes + 1, np.int32)  # position in the queue of the node before it
    queue[0] = (level.row * side + level.col) << 2 | level.direction
    reached_by[queue[0]] = 1
    head, tail = 0, 1
    while head < tail:
        node = np.int64(queue[np.uint64(head)])
        direction = node & 3
        step = (1 - (direction & 2)) * (side if direction & 1 else 1)
        ahead = ((node >> 2) & cell_mask) + step
        what = np.int64(terrain[np.uint64(ahead)])
        action, reached = GO, node + (step << 2) * (what != BLOCKED)
        if what >= FIRST_KEY:
            layer = node >> layer_shift
            opened = layer >> n_keys
            if what < FIRST_DOOR:
                if not (layer >> (what - FIRST_KEY)) & 1:
                    action, reached = TAKE, node + (1 << (what - FIRST_KEY + layer_shift))
            elif opened <= what - FIRST_DOOR:
                place = what - FIRST_DOOR
                can_open = opened == place and layer & needs[place] == needs[place]
                action, reached = UNLOCK, node + (1 << (n_keys + layer_shift)) if can_open else node
        if ahead == target and (kind == THE_EXIT or reached != node):
            return trace(queue, parents, reached_by, head, action)
        tail = append(queue, parents, reached_by, tail, head, action, reached)
        left, right = node - direction + ((direction + 3) & 3), node - direction + ((direction + 1) & 3)
        tail = append(queue, parents, reached_by, tail, head, TURN_LEFT, left)
        tail = append(queue, parents, reached_by, tail, head, TURN_RIGHT, right)
        head += 1
    return needs[:0], -1


@njit(cache=True)
def append(queue, parents, reached_by, tail, head, action, node):
    """Append a node to the queue if it is new, and return the queue's new end.

    It always writes, because an unpredictable branch takes longer.
    """
    index, end = np.uint64(node), np.uint64(tail)
    known = reached_by[index]
    is_new = known == 0
    queue[end], parents[end] = node, head
    reached_by[index] = known + is_new * (action + 1)
    return tail + is_new


@njit(cache=True)
def trace(queue, parents, reached_by, last, final_action):
    """Return the actions from the start to node ``last`` of the queue, then the final action, and their number."""
    length, position = 1, last
    while position > 0:
        length += 1
        position = parents[position]
    path = np.empty(length, np.int64)
    path[length - 1] = final_action
    position = last
    for i in range(length - 2, -1, -1):
        path[i] = reached_by[queue[position]] - 1
        position = parents[position]
    return path, length


@njit(cache=True, nogil=True)
def solve_levels(levels, rooms, side, envs, goals, lengths):
    """Write the lengths [M] of the shortest paths to goals [M] in environments [M]."""
    for m in range(envs.shape[0]):
        _, lengths[m] = solve(levels[envs[m]], rooms, side, goals[m] // N_COLOURS, goals[m] % N_COLOURS)


_SOLVE = Compiled(solve_levels, np.zeros(1, LEVEL), NO_MAPS.rooms, 1, *np.zeros((3, 1), np.int64))


def shortest_lengths(
    state: State, goals: ArrayLike = EXIT_GOAL, envs: NDArray[np.integer] | None = None
) -> NDArray[np.int64]:
    """Count the actions in the shortest solutions of environments.

    Args:
        state: N environments; their goal graphs may differ.
        goals: goal id 0 to 12, one for all environments or [M].
        envs: [M] the environments, from `seeds.chosen_envs`; None: all.

    Returns:
        Lengths [M] int64: 0 if the goal is already achieved, -1 if it cannot be. Then it does not exist, its key is out
        of reach, or the episode has ended at the exit.
    """
    given = np.asarray(goals)
    if given.dtype.kind not in "iu" or (given.size and not 0 <= given.min() <= given.max() < N_GOALS):
        raise InputError(f"goals must be whole numbers from 0 to {N_GOALS - 1}, not {goals}")
    envs = np.arange(len(state)) if envs is None else envs
    given, lengths = np.full(len(envs), given, np.int64), np.empty(len(envs), np.int64)
    levels, rooms = np.ascontiguousarray(state.levels), state.maps.rooms
    _SOLVE.run(levels, rooms, state.grids.shape[1], envs, given, lengths)
    return lengths


def shortest_actions(state: State, goal: int = EXIT_GOAL) -> NDArray[np.int64]:
    """Find a shortest sequence of actions that achieves a goal (any one of several).

    Args:
        state: one environment.
        goal: goal id 0 to 12, by default the exit.

    Returns:
        [length] int64, empty if the goal is achieved already. A path to a key or a door never enters the exit.
    """
    if len(state) != 1:
        raise InputError(
            f"shortest_actions solves one environment, but the state holds {len(state)}: index the state first"
        )
    Whole(0, N_GOALS - 1).check(goal, "a goal")
    side, rooms = state.grids.shape[1], state.maps.rooms
    path, length = solve(state.levels[0], rooms, side, goal // N_COLOURS, goal % N_COLOURS)
    if length < 0:
        name = goal_name(state.levels[0], goal)
        raise InputError(
            f"the goal {name} cannot be achieved: it does not exist, its key is out of reach, or the episode has ended"
        )
    return ACTIONS[path]
