"""The numbers of each feature, compared with a plain reading of the level, and their cardinalities."""

from dataclasses import replace

import numpy as np
import pytest
from escape_room import FEATURES
from turns_helpers import make

from hierroom.agents.features import Features
from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NAMED_GRAPHS, NO_GOAL
from hierroom.meta import make_meta, take_turn
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import EXIT, KEY, LOCKED_DOOR, VIEW
from hierroom.worlds.escape_room.level_view import LevelView
from hierroom.worlds.escape_room.tiles import TRIPLES
from hierroom.worlds.make import world_spec

N_ENVS, N_ACTIONS = 16, 6
WORLD = world_spec(EnvConfig(drop_key=True))
CONTROLLERS = tuple(name for name in FEATURES if name != "goal-outcome")


def tile_of(goal):
    if goal == EXIT_GOAL:
        return EXIT
    return KEY + goal if goal < FIRST_DOOR_GOAL else LOCKED_DOOR + goal - FIRST_DOOR_GOAL


def object_and_colour(goal):
    """Return 0 for no goal, 1 for a key, 2 for a door or 3 for the exit, which is green; and the colour from 1 on."""
    if goal == NO_GOAL:
        return [0, 0]
    if goal == EXIT_GOAL:
        return [3, 1 + COLOURS.index("green")]
    return [1 + goal // FIRST_DOOR_GOAL, 1 + goal % N_COLOURS]


def played():
    """Yield turns, observations and last actions of controllers in random play."""
    turns = make([NAMED_GRAPHS["b"], NAMED_GRAPHS["f"]], N_ENVS, seed=5, size=13, max_steps=300, drop_key=True)
    meta, rng, last = make_meta("random"), np.random.default_rng(2), np.full(N_ENVS, N_ACTIONS)
    for _ in range(900):
        take_turn(meta, turns)
        others = rng.random(N_ENVS) < 0.1
        turns.ledger.write_fields({"goals": rng.integers(NO_GOAL, N_GOALS, others.sum())}, others)
        yield turns, turns.observe("controller_0", np.arange(N_ENVS)), last
        last = rng.choice(N_ACTIONS, N_ENVS, p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1])
        step = turns.step(last)
        last = np.where(step.episode_ended, N_ACTIONS, last)


def test_features_equal_a_plain_reading_of_the_level():
    compared = dict.fromkeys(("no goal", "key", "door", "exit", "in view", "in no view", "held", "opened"), 0)
    for _, observation, last in played():
        now = {name: FEATURES[name].encode(observation).tolist() for name in CONTROLLERS}
        assert now["direction"] == [[level.direction] for level in observation.levels]
        assert now["previous-action"] == [[action] for action in last]
        given = [replace(observation, goals=np.full(N_ENVS, goal)) for goal in range(N_GOALS)]
        of_each = np.concatenate([FEATURES["goal-place"].encode(one) for one in given], axis=1)
        assert now["object-places"] == of_each.tolist()
        assert now["view"] == now["view-ids"] == observation.tiles.reshape(N_ENVS, VIEW * VIEW).tolist()
        for n, (level, goal, tiles) in enumerate(zip(observation.levels, observation.goals, now["view"], strict=True)):
            assert now["goal"][n] == object_and_colour(goal)
            assert now["symbol"][n] == [N_GOALS if goal == NO_GOAL else goal]
            held, opened = (
                {int(level.colours[b]) for b in range(level.n_rooms - 1) if bits >> b & 1}
                for bits in (level.keys, level.doors)
            )
            assert now["keys"][n] == [int(colour in held) for colour in range(N_COLOURS)]
            achieved = held | {FIRST_DOOR_GOAL + colour for colour in opened}
            seen = {goal for goal in range(N_GOALS) if level.seen >> goal & 1}
            assert now["goal-status"][n] == [2 if g in achieved else int(g in seen) for g in range(N_GOALS)]
            cells = [] if goal == NO_GOAL else [cell for cell, tile in enumerate(tiles) if tile == tile_of(goal)]
            assert now["goal-in-view"][n] == (cells or [VIEW * VIEW])
            compared["in view" if cells else "in no view"] += goal != NO_GOAL
            compared[("no goal", "key", "door", "exit")[object_and_colour(goal)[0]]] += 1
            compared["held"] += bool(held)
            compared["opened"] += bool(opened)
    assert min(compared.values()) > 100, compared


def test_goal_outcome_shows_the_last_goals_outcome():
    outcomes = set()
    for turns, *_ in played():
        observation = turns.observe("meta_0", np.arange(N_ENVS))
        shown = FEATURES["goal-outcome"].encode(observation)
        for row, goal, outcome in zip(shown, observation.goals, observation.outcomes, strict=True):
            assert row.tolist() == [outcome if g == goal else 0 for g in range(N_GOALS)]
            outcomes.add(int(outcome))
    assert len(outcomes) > 1


def test_distances_fall_into_thirteen_classes():
    """0, 1, 2, 3, 4 to 7, 8 to 15, and 16 and more cells ahead or behind, to the right or to the left."""
    classes = [0, 1, 2, 3, *[4] * 4, *[5] * 8, *[6] * 35]
    distances = [*range(-50, 51)]
    turns = make(NAMED_GRAPHS["a"], len(distances), size=63)
    observation = turns.observe("controller_0", np.arange(len(distances)))
    levels = observation.levels.copy()
    levels["direction"], levels["row"], levels["col"], levels["seen"] = 0, 60, 60, 1 << EXIT_GOAL  # facing east
    levels["exit_at"] = np.stack([60 + np.array(distances[::-1]), 60 + np.array(distances)], axis=1)
    exits = np.full(len(distances), EXIT_GOAL)
    places = FEATURES["goal-place"].encode(replace(observation, view=LevelView(observation.tiles, levels), goals=exits))
    expected = [6 + (classes[d] if d > 0 else -classes[-d]) for d in distances]
    assert places.tolist() == [[ahead, right] for ahead, right in zip(expected, expected[::-1], strict=True)]


CARDINALITIES = {"view": (22,) * 49, "view-ids": (22,) * 49, "goal": (4, 7), "goal-in-view": (50,), "symbol": (14,)}
CARDINALITIES |= {f"{name}-places": (14,) * n for name, n in {"object": 26, "doorway": 4, "frontier": 4}.items()}
CARDINALITIES |= {"goal-place": (14,) * 2, "direction": (4,), "keys": (2,) * 6, "previous-action": (7,)}
CARDINALITIES |= {"goal-status": (3,) * 13, "goal-outcome": (4,) * 13}


@pytest.mark.parametrize("name", FEATURES)
def test_each_feature_has_its_cardinalities(name):
    agent = "meta_0" if name == "goal-outcome" else "controller_0"
    assert Features(WORLD, [name], agent).cardinalities == CARDINALITIES[name]


def test_several_features_are_concatenated():
    names = ["goal", "view-ids", "direction", "frontier-places", "doorway-places"]
    features = Features(WORLD, names)
    assert features.cardinalities == sum((CARDINALITIES[name] for name in names), ())
    assert features.memories == ("explored", "doorways")
    vectors = features.vectors
    assert [one is None for one in vectors] == [True] * 2 + [False] * 49 + [True] * 9
    np.testing.assert_array_equal(vectors[2], TRIPLES)
    assert Features(WORLD, ["view", "goal"]).vectors is None
    (_, observation, _) = next(played())
    expected = np.concatenate([FEATURES[name].encode(observation) for name in names], axis=1)
    np.testing.assert_array_equal(features.encode(observation), expected)
    assert features.encode(observation).dtype == np.uint8


@pytest.mark.parametrize(
    ("names", "is_by_goal"), [(["goal-status"], True), (["goal-status", "goal-outcome"], True), (["keys"], False)]
)
def test_are_by_goal_is_true_for_goal_features(names, is_by_goal):
    assert Features(WORLD, names, "meta_0").are_by_goal == is_by_goal
    assert not Features(WORLD, [*names, "view"], "meta_0").are_by_goal


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("view", "given as a list of names, not as 'view'"),
        (["view", "taste"], "features are view, .*; not taste"),
        ([], "not none at all"),
        (["goal-outcome"], "goal-outcome belongs to meta_features, not to features"),
    ],
)
def test_an_unknown_feature_raises_input_error(names, message):
    with pytest.raises(InputError, match=message):
        Features(WORLD, names)
