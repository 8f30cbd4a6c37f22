"""Features give positions of goals and doorways that the agent saw or used in the current episode only."""

import numpy as np
import pytest
from escape_room import FEATURES, WORLD
from turns_helpers import make
from views import shown_goals

from hierroom.agents.config import AgentsConfig
from hierroom.agents.features import Features
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, NAMED_GRAPHS, NO_GOAL
from hierroom.meta import make_meta, take_turn
from hierroom.runs.assembly import make_turns
from hierroom.runs.config.presets import find_preset
from hierroom.turns.records import META
from hierroom.worlds.escape_room.constants import COL_STEP, LOCKED_DOOR, OPEN_DOOR, ROW_STEP, VIEW
from hierroom.worlds.escape_room.features import UNKNOWN_DISTANCE

N_ENVS = 16
OWN_CELL = VIEW // 2 * VIEW + VIEW - 1


def class_of(cells):
    """Return the class of a distance in the table of `features`: 0 is far behind, 6 is here, 12 is far ahead."""
    by_cells = [0, 1, 2, 3, 4, 4, 4, 4, *[5] * 8, *[6] * 50]
    return 6 + by_cells[cells] if cells >= 0 else 6 - by_cells[-cells]


def place_of(level, cell):
    down, east = cell[0] - level.row, cell[1] - level.col
    rows, cols = ROW_STEP[level.direction], COL_STEP[level.direction]
    return [class_of(down * rows + east * cols), class_of(down * cols - east * rows)]


@pytest.mark.slow
def test_goal_place_is_the_last_seen_position():
    settings = {"size": 15, "max_steps": 300, "drop_key": True, "goal_mask": "none", "subgoal_horizon": 7}
    turns = make([NAMED_GRAPHS["a"], NAMED_GRAPHS["f"]], N_ENVS, seed=3, **settings)
    meta = make_meta("random")
    rng, memories = np.random.default_rng(0), [{} for _ in range(N_ENVS)]
    compared = {"no goal": 0, "not there": 0, "not seen yet": 0, "in view": 0, "remembered": 0, "dropped": 0}
    for _ in range(700):
        take_turn(meta, turns)
        turns.ledger.write_fields({"goals": NO_GOAL}, rng.random(N_ENVS) < 0.01)
        observation = turns.observe("controller_0", np.arange(N_ENVS))
        places, in_view = FEATURES["goal-place"].encode(observation), FEATURES["goal-in-view"].encode(observation)
        for level, memory, view, goal, place, cell in zip(
            observation.levels, memories, observation.tiles, observation.goals, places, in_view[:, 0], strict=True
        ):
            memory.update(shown_goals(level, view))
            if goal == NO_GOAL or goal not in memory:
                exists = goal == EXIT_GOAL or goal % N_COLOURS in level.colours[: level.n_rooms - 1]
                compared["no goal" if goal == NO_GOAL else "not seen yet" if exists else "not there"] += 1
                assert place.tolist() == [UNKNOWN_DISTANCE, UNKNOWN_DISTANCE]
                continue
            assert place.tolist() == place_of(level, memory[goal])
            is_in_view = cell < VIEW * VIEW and cell != OWN_CELL  # where the key that is carried is shown
            compared["in view" if is_in_view else "remembered"] += 1
            if is_in_view:
                assert place.tolist() == [class_of(VIEW - 1 - cell % VIEW), class_of(cell // VIEW - VIEW // 2)]
            found_not_held = level.found & ~level.keys
            compared["dropped"] += goal < FIRST_DOOR_GOAL and found_not_held >> level.branches[goal] & 1
        step = turns.step(rng.choice(6, N_ENVS, p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1]))
        for n in np.flatnonzero(step.episode_ended):
            memories[n].clear()
    assert min(compared.values()) > 50, compared


def test_doorway_places_are_the_last_two_used():
    turns = make([NAMED_GRAPHS["c"], NAMED_GRAPHS["e"]], N_ENVS, size=13, max_steps=500, seed=4)
    rng, histories = np.random.default_rng(1), [[] for _ in range(N_ENVS)]  # a cell each time a door is used
    compared = {"none yet": 0, "one": 0, "two": 0, "opened": 0, "walked through": 0}
    for _ in range(1800):
        observation = turns.observe("controller_0", np.arange(N_ENVS))
        for level, history, places in zip(
            observation.levels, histories, FEATURES["doorway-places"].encode(observation), strict=True
        ):
            latest = list(dict.fromkeys(reversed(history)))[:2]
            known = [axis for cell in latest for axis in place_of(level, cell)]
            assert places.tolist() == known + [UNKNOWN_DISTANCE] * (4 - len(known))
            compared[["none yet", "one", "two"][len(latest)]] += 1
        step = turns.step(rng.choice(5, N_ENVS, p=[0.4, 0.15, 0.15, 0.15, 0.15]))
        for n, (level, grid) in enumerate(zip(turns.world.state.levels, turns.world.state.grids, strict=True)):
            if step.episode_ended[n]:
                histories[n].clear()
            elif step.events[n] in range(FIRST_DOOR_GOAL, EXIT_GOAL):
                ahead = level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]
                histories[n].append(ahead)
                compared["opened"] += 1
            elif OPEN_DOOR <= grid[level.row, level.col] < LOCKED_DOOR:
                histories[n].append((level.row, level.col))
                compared["walked through"] += 1
    assert min(compared.values()) > 20, compared


@pytest.mark.parametrize("meta", ["learned", "fixed-dfs"])
def test_levels_keep_memories_for_meta_features(meta):
    """A learned meta-controller once saw constants if the controller had no such feature."""
    config = find_preset("paper").changed(meta=meta, meta_features=("goal-status", "frontier-places"), num_envs=4)
    turns, features = make_turns(config, 4, 0, levels="training"), Features(WORLD, config.agents.meta_features, META)
    shown = []
    for action in np.random.default_rng(0).integers(5, size=300):
        turns.step(np.full(4, action))
        shown.append(features.encode(turns.situation(np.arange(4)))[:, -4:])
    assert (len(np.unique(np.concatenate(shown), axis=0)) > 10) == (meta == "learned")


def test_agents_config_docstring_names_each_feature():
    help_text = " ".join((AgentsConfig.__doc__ or "").split())
    assert all(name in help_text for name in FEATURES)
