"""Where goals and doorways are said to be: what was seen or walked through this episode, and nothing else."""

import numpy as np
from views import in_view

from hierroom.agents.features import FEATURES, UNKNOWN_DISTANCE
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, NAMED_GRAPHS, NO_GOAL
from hierroom.meta import make_meta
from hierroom.turns import Turns
from hierroom.world.kernels import COL_STEP, EXIT, KEY, LOCKED_DOOR, OPEN_DOOR, ROW_STEP, VIEW, WALL
from hierroom.world.world import World

N_ROOMS = 16
OWN_CELL = VIEW // 2 * VIEW + VIEW - 1


def code(cells):
    """The class of a distance by the table of `inputs`, from 0, far behind, over 6, here, to 12, far ahead."""
    by_cells = [0, 1, 2, 3, 4, 4, 4, 4, *[5] * 8, *[6] * 50]
    return 6 + by_cells[cells] if cells >= 0 else 6 - by_cells[-cells]


def codes_of(room, cell):
    """The codes of (row, col) as seen from where the agent is."""
    down, east = cell[0] - room.row, cell[1] - room.col
    rows, cols = ROW_STEP[room.direction], COL_STEP[room.direction]
    return [code(down * rows + east * cols), code(down * cols - east * rows)]


def shown_goals(room, view):
    """(goal id, cell) of each key, door and exit in a view; not the key that is carried."""
    for cell, tile in in_view(room, view):
        if tile == EXIT:
            yield 12, cell
        elif KEY <= tile < OPEN_DOOR and cell != (room.row, room.col):
            yield tile - KEY, cell
        elif OPEN_DOOR <= tile < WALL:
            yield FIRST_DOOR_GOAL + (tile - OPEN_DOOR) % (LOCKED_DOOR - OPEN_DOOR), cell


def test_the_goal_is_where_views_of_this_episode_showed_it_last():
    world = World([NAMED_GRAPHS["a"], NAMED_GRAPHS["f"]], N_ROOMS, size=15, max_steps=300, drop_key=True, seed=3)
    turns, meta = Turns(world, goal_mask="none", subgoal_horizon=7), make_meta("random")
    rng, memories = np.random.default_rng(0), [{} for _ in range(N_ROOMS)]
    compared = {"no goal": 0, "not there": 0, "not seen yet": 0, "in view": 0, "remembered": 0, "dropped": 0}
    for _ in range(2000):
        turns.ask(meta)
        turns.goals[rng.random(N_ROOMS) < 0.01] = NO_GOAL
        observation = turns.observation()
        places, in_view = FEATURES["goal-place"].codes(observation), FEATURES["goal-in-view"].codes(observation)
        for room, memory, view, goal, place, cell in zip(
            observation.levels, memories, observation.tiles, observation.goals, places, in_view[:, 0], strict=True
        ):
            memory.update(shown_goals(room, view))
            if goal == NO_GOAL or goal not in memory:
                exists = goal == EXIT_GOAL or goal % N_COLOURS in room.colours[: room.n_rooms - 1]
                compared["no goal" if goal == NO_GOAL else "not seen yet" if exists else "not there"] += 1
                assert place.tolist() == [UNKNOWN_DISTANCE, UNKNOWN_DISTANCE]
                continue
            assert place.tolist() == codes_of(room, memory[goal])
            is_in_view = cell < VIEW * VIEW and cell != OWN_CELL  # where the key that is carried is shown
            compared["in view" if is_in_view else "remembered"] += 1
            if is_in_view:
                assert place.tolist() == [code(VIEW - 1 - cell % VIEW), code(cell // VIEW - VIEW // 2)]
            found_not_held = room.found & ~room.keys
            compared["dropped"] += goal < FIRST_DOOR_GOAL and found_not_held >> room.branches[goal] & 1
        step = turns.step(rng.choice(6, N_ROOMS, p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1]))
        for n in np.flatnonzero(step.episode_ended):
            memories[n].clear()
    assert min(compared.values()) > 50, compared


def test_the_doorways_are_the_two_opened_or_walked_through_last():
    turns = Turns(World([NAMED_GRAPHS["c"], NAMED_GRAPHS["e"]], N_ROOMS, size=13, max_steps=500, seed=4))
    rng, histories = np.random.default_rng(1), [[] for _ in range(N_ROOMS)]  # a cell each time a door is used
    compared = {"none yet": 0, "one": 0, "two": 0, "opened": 0, "walked through": 0}
    for _ in range(3000):
        observation = turns.observation()
        for room, history, places in zip(
            observation.levels, histories, FEATURES["doorway-places"].codes(observation), strict=True
        ):
            latest = list(dict.fromkeys(reversed(history)))[:2]
            known = [code for cell in latest for code in codes_of(room, cell)]
            assert places.tolist() == known + [UNKNOWN_DISTANCE] * (4 - len(known))
            compared[["none yet", "one", "two"][len(latest)]] += 1
        step = turns.step(rng.choice(5, N_ROOMS, p=[0.4, 0.15, 0.15, 0.15, 0.15]))
        for n, (room, grid) in enumerate(zip(turns.world.state.levels, turns.world.state.grids, strict=True)):
            if step.episode_ended[n]:
                histories[n].clear()
            elif step.events[n] in range(FIRST_DOOR_GOAL, EXIT_GOAL):
                ahead = room.row + ROW_STEP[room.direction], room.col + COL_STEP[room.direction]
                histories[n].append(ahead)
                compared["opened"] += 1
            elif OPEN_DOOR <= grid[room.row, room.col] < LOCKED_DOOR:
                histories[n].append((room.row, room.col))
                compared["walked through"] += 1
    assert min(compared.values()) > 20, compared
