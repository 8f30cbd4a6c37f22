"""`Level`, compared with the raw state: tiles of the grid, views of the episode and the goal graph."""

import math

import numpy as np
import pytest
from turns_helpers import make, open_goals, well_or_wildly
from views import shown_goals

from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, N_GOALS, NAMED_GRAPHS, GoalGraph
from hierroom.worlds.escape_room.constants import COL_STEP, EXIT, KEY, LOCKED_DOOR, MARGIN, OPEN_DOOR, ROW_STEP
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS
from hierroom.worlds.escape_room.level import goal_name

GRAPHS = [NAMED_GRAPHS["a"], NAMED_GRAPHS["d"], NAMED_GRAPHS["f"], GoalGraph((0, 0, 1, 0, 2, 4), 5)]
STEPS = {"east": (0, 1), "south": (1, 0), "west": (0, -1), "north": (-1, 0)}
N_ENVS = 8


def cell_of(grid, *tiles):
    """Return (row, col), from the grid's upper left corner, of the only cell with one of the tiles, or None."""
    cells = np.argwhere(np.isin(grid, tiles)) - MARGIN
    assert len(cells) <= 1
    return tuple(cells[0].tolist()) if len(cells) else None


def cells_of_goals(grid):
    """Return (row, col) by goal id of the goals on the grid, which has no held keys."""
    cells = {colour: cell_of(grid, KEY + colour) for colour in range(6)}
    cells |= {FIRST_DOOR_GOAL + c: cell_of(grid, LOCKED_DOOR + c, OPEN_DOOR + c) for c in range(6)}
    cells[EXIT_GOAL] = cell_of(grid, EXIT)
    return {goal: cell for goal, cell in cells.items() if cell is not None}


def reachable_goals(record, graph, held, opened):
    colours = record.colours[: graph.n_rooms - 1].tolist()
    keys, doors = [colour in held for colour in colours], [colour in opened for colour in colours]
    ids = [*colours, *(FIRST_DOOR_GOAL + colour for colour in colours), EXIT_GOAL]
    return {goal for goal, is_open in zip(ids, open_goals(graph, keys, doors), strict=True) if is_open}


def check(level, turns, n, lay, seen):
    """Check one environment; ``lay`` has the last position of each goal, ``seen`` the goals that came into view."""
    state, mask = turns.world.get_state(n), turns.situation(np.array([n])).masks[0]
    record, grid = state.levels[0], state.grids[0]
    on_grid = cells_of_goals(grid)
    held = {goal for goal in lay if goal < FIRST_DOOR_GOAL and goal not in on_grid}
    opened = {colour for colour in range(6) if (grid == OPEN_DOOR + colour).any()}
    reachable = reachable_goals(record, level.graph, held, opened)
    here, ahead = level.agent.position, STEPS[level.agent.direction]
    assert (here[0] + MARGIN, here[1] + MARGIN, level.agent.steps) == (record.row, record.col, record.steps)
    assert ahead == (ROW_STEP[record.direction], COL_STEP[record.direction])
    assert level.graph in GRAPHS
    assert [goal.id for goal in level.goals] == list(range(N_GOALS))
    for goal in level.goals:
        colour = goal.id % 6
        words = {"exit": "exit"}.get(goal.kind, f"{goal.colour} {goal.kind}" + f" {goal.room}" * goal.exists)
        assert str(goal) == goal.name == goal_name(record, goal.id) == words
        assert goal.kind == ("exit" if goal.id == EXIT_GOAL else "key" if goal.id < FIRST_DOOR_GOAL else "door")
        assert goal.colour == ("green" if goal.id == EXIT_GOAL else COLOURS[colour])
        assert goal.exists == (goal.id in lay)
        assert goal.position == lay.get(goal.id)
        distance = np.abs(np.subtract(goal.position, here)).sum() if goal.exists else math.inf
        assert goal.distance == distance
        assert goal.was_seen == (goal.id in seen)
        assert goal.is_reachable == (goal.id in reachable)
        assert goal.is_legal == mask[goal.id]
        assert goal.achieved == (goal.id in held or goal.id - FIRST_DOOR_GOAL in opened)
        if goal.id == EXIT_GOAL:
            top, left, bottom, right = record.rectangles[goal.room] - MARGIN
            assert goal.room == level.graph.exit_room
            assert top <= goal.position[0] <= bottom
            assert left <= goal.position[1] <= right
        else:
            assert goal.room == (record.colours.tolist().index(colour) + 1 if goal.exists else 0)
        if goal.kind == "door" and goal.exists:  # next to the room that it opens
            top, left, bottom, right = record.rectangles[goal.room] - MARGIN
            row, col = goal.position
            assert max(top - row, row - bottom, 0) + max(left - col, col - right, 0) == 1
    assert [goal.id for goal in level.legal_goals] == np.flatnonzero(mask[:N_GOALS]).tolist()
    return held, opened, reachable


@pytest.mark.slow
@pytest.mark.parametrize("mask", GOAL_MASKS)
def test_level_equals_the_raw_state(mask):
    settings = {"size": 15, "max_steps": 90, "drop_key": True, "goal_mask": mask, "subgoal_horizon": 6}
    turns, rng = make(GRAPHS, N_ENVS, seed=7, **settings), np.random.default_rng(3)
    lay, seen = [{} for _ in range(N_ENVS)], [set() for _ in range(N_ENVS)]
    met = dict.fromkeys(("held", "dropped", "open", "not there", "not seen", "reachable", "legal", "waiting"), 0)
    for step in range(180):
        for n in range(N_ENVS):
            record = turns.world.state.levels[n]
            lay[n] |= cells_of_goals(turns.world.state.grids[n])
            seen[n] |= {goal for goal, _ in shown_goals(record, turns.world.outcomes["tiles"][n])}
        situation = turns.situation(np.arange(N_ENVS))
        for n in range(step % 3, N_ENVS, 3):
            level = situation.level(n)
            held, opened, reachable = check(level, turns, n, lay[n], seen[n])
            record = turns.world.state.levels[n]
            met["held"] += bool(held)
            met["dropped"] += bool(record.found & ~record.keys)
            met["open"] += bool(opened)
            met["not there"] += len(lay[n]) < N_GOALS
            met["not seen"] += len(seen[n]) < len(lay[n])
            met["reachable"] += bool(reachable)
            met["legal"] += bool(level.legal_goals)
            met["waiting"] += not level.legal_goals
        if step % 2:
            turns.choose(situation, rng.integers(14, size=N_ENVS))
        ended = turns.step([well_or_wildly(rng, turns.world, n) for n in range(N_ENVS)]).episode_ended
        for n in np.flatnonzero(ended):
            lay[n].clear()
            seen[n].clear()
    assert min(met.values()) > 10, met


def test_level_does_not_change_with_later_steps():
    turns = make("c", seed=5)
    situation = turns.situation(np.array([0]))
    level, again = situation.level(0), situation.level(0)
    for _ in range(3):
        turns.step([0])
        turns.step([1])
    assert level == again == situation.level(0) != turns.situation(np.array([0])).level(0)


def test_level_str_is_one_line():
    level = make("a", 1, size=11).situation(np.zeros(1, int)).level(0)
    (key,) = level.legal_goals
    row, col = level.agent.position
    where = f"agent at row {row}, column {col} facing {level.agent.direction}"
    assert str(level) == f"graph a, step 0, {where}; legal goals: {key.colour} key 1"
    assert goal_name(make("a").world.state.levels[0], -1) == "no goal"
