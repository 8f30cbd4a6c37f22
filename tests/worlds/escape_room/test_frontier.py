"""Explored cells and their frontier, compared with sets of cells kept by the test."""

import numpy as np
import pytest
from escape_room import FEATURES
from turns_helpers import make
from views import in_view

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.worlds.escape_room.constants import LOCKED_DOOR, MARGIN, WALL
from hierroom.worlds.escape_room.features import UNKNOWN_DISTANCE, nearest_frontiers
from hierroom.worlds.escape_room.layout import NO_MAPS

N_ENVS = 8


def bits(lines):
    return {
        (line + MARGIN, col + MARGIN)
        for line, word in enumerate(lines.tolist())
        for col in range(64)
        if word >> col & 1
    }


def is_inside(cell, rectangle):
    top, left, bottom, right = rectangle
    return top <= cell[0] <= bottom and left <= cell[1] <= right


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "graphs"), [(13, [NAMED_GRAPHS[letter] for letter in "cef"]), (63, [GoalGraph((0, 0, 0, 0, 0, 0), 6)])]
)
def test_explored_maps_and_frontiers_follow_the_views(size, graphs):
    turns = make(graphs, N_ENVS, size=size, max_steps=400, drop_key=True, seed=5)
    rng, seen, floor = np.random.default_rng(2), [set() for _ in range(N_ENVS)], [set() for _ in range(N_ENVS)]
    compared = {"here": 0, "elsewhere": 0, "none here": 0, "none elsewhere": 0}
    in_doorway = 0
    for step in range(900 if size == 13 else 300):
        observation = turns.observe("controller_0", np.arange(N_ENVS))
        for n, level in enumerate(observation.levels):
            for cell, tile in in_view(level, observation.tiles[n]):
                seen[n].add(cell)
                if tile != WALL and tile < LOCKED_DOOR:
                    floor[n].add(cell)
            assert bits(level.explored) == seen[n]
        if step % 5 == 0:
            found = nearest_frontiers(observation.levels, NO_MAPS)
            places = FEATURES["frontier-places"].encode(observation)
            assert found.shape == (N_ENVS, 2, 2)
            for n, level in enumerate(observation.levels):
                beside = [(0, 1), (1, 0), (0, -1), (-1, 0)]
                frontier = [
                    (row, col)
                    for row, col in sorted(floor[n])
                    if not all((row + down, col + right) in seen[n] for down, right in beside)
                ]
                agent = int(level.row), int(level.col)
                home = [rectangle for rectangle in level.rectangles[: level.n_rooms] if is_inside(agent, rectangle)]
                here = [cell for cell in frontier if home and is_inside(cell, home[0])]
                elsewhere = [cell for cell in frontier if cell not in here]
                for place, cells in enumerate((here, elsewhere)):
                    nearest = min(cells, key=lambda c: abs(c[0] - agent[0]) + abs(c[1] - agent[1]), default=(0, 0))
                    assert tuple(found[n, place]) == nearest
                    assert (places[n, 2 * place] == UNKNOWN_DISTANCE) == (not cells)
                compared["here" if here else "none here"] += 1
                compared["elsewhere" if elsewhere else "none elsewhere"] += 1
                in_doorway += not home
        if size > 13 and step % 20 == 0:  # move the agent, or most of a large level is never seen
            for level in turns.world._state.levels:
                top, left, bottom, right = level.rectangles[rng.integers(level.n_rooms)]
                level.row, level.col = rng.choice([top, bottom, (top + bottom) // 2]), rng.choice([left, right])
        ended = turns.step(rng.choice(6, N_ENVS, p=[0.45, 0.15, 0.15, 0.1, 0.1, 0.05])).episode_ended
        for n in np.flatnonzero(ended):
            seen[n].clear()
            floor[n].clear()
    assert min(compared.values()) > 5, compared
    assert size > 13 or in_doorway > 5


def test_open_doorway_is_frontier_until_neighbours_are_seen():
    levels = make(GoalGraph((0,) * 6, 1), N_ENVS, size=19, seed=6).world.state.levels
    for branch in range(6):
        doorways = levels["doors_at"][:, branch].astype(np.int64)
        for beside in (), ((0, 1), (0, -1), (1, 0), (-1, 0)):
            is_open, is_locked = levels.copy(), levels.copy()
            is_open["doors"], is_locked["doors"] = 1 << branch, 0
            for now in is_open, is_locked:
                now["explored"] = 0
                for down, right in ((0, 0), *beside):
                    rows, cols = (doorways - MARGIN + np.array([down, right])).T
                    now["explored"][np.arange(N_ENVS), rows] |= np.uint64(1) << cols.astype(np.uint64)
            found, found_locked = nearest_frontiers(is_open, NO_MAPS), nearest_frontiers(is_locked, NO_MAPS)
            if beside:
                np.testing.assert_array_equal(found, found_locked)
            else:
                assert found[:, 1].tolist() == doorways.tolist()
                assert not found_locked.any()


def test_nearest_tie_takes_the_upper_cell():
    levels = make(GoalGraph((0,) * 6, 1), size=63).world.state.levels.copy()
    levels["rectangles"], levels["doors"], levels["explored"] = 6, 0b11, 0
    levels["row"], levels["col"] = 40, 40
    for branch, (row, col) in enumerate([(40, 23), (39, 56)]):  # 17 steps away, and more than half a grid apart
        levels["doors_at"][:, branch] = row, col
        levels["explored"][:, row - MARGIN] |= np.uint64(1) << np.uint64(col - MARGIN)
    assert nearest_frontiers(levels, NO_MAPS)[0, 1].tolist() == [39, 56]
