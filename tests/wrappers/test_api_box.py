"""The box view: its numbers, and PettingZoo's checkers."""

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

import hierroom

BOTH = ("meta_0", "controller_0")


def make(**settings):
    return hierroom.box_view(hierroom.parallel_env(**{"graph": "a", "size": 11, "max_steps": 60, **settings}))


def test_both_agents_have_equal_box_spaces():
    env = make()
    for agent in BOTH:
        assert env.observation_space(agent) == Box(0, 1, (191,), np.float32)
        assert env.action_space(agent) == Discrete(14)


def numbers(agent, observation):
    """Repeat the table in the docstring of `box_view`."""
    one_hot = [0] * 4
    one_hot[observation["direction"]] = 1
    outcome = [0] * 4
    if agent == "meta_0":
        outcome[observation["outcome"]] = 1
    mask = observation["action_mask"].tolist()
    head = [value / 10 for value in observation["observation"].ravel().tolist()] + observation["goal"].tolist()
    held = observation["keys_held"].tolist() + observation["doors_open"].tolist()
    return [*head, *one_hot, *held, *outcome, *mask, *[0] * (14 - len(mask)), agent == "meta_0"]


@pytest.mark.parametrize("drop_key", [False, True])
def test_boxes_contain_the_numbers_of_the_dicts(drop_key):
    settings = {"drop_key": drop_key, "goal_mask": "none", "subgoal_horizon": 3, "reward": "bonus"}
    env, plain = make(**settings), hierroom.parallel_env(graph="a", size=11, max_steps=60, **settings)
    rng = np.random.default_rng(0)
    (seen, infos), (expected, expected_infos) = env.reset(seed=3), plain.reset(seed=3)
    outcomes, directions = set(), set()
    for _ in range(200):
        for agent in BOTH:
            mask = expected[agent]["action_mask"].tolist()
            assert infos[agent].pop("action_mask") == [*mask, *[0] * (14 - len(mask))]
            assert env.observation_space(agent).contains(seen[agent])
            np.testing.assert_allclose(seen[agent], numbers(agent, expected[agent]), atol=1e-6)
        assert infos == expected_infos
        outcomes.add(int(expected["meta_0"]["outcome"]))
        directions.add(int(expected["meta_0"]["direction"]))
        if not env.agents:
            (seen, infos), (expected, expected_infos) = env.reset(), plain.reset()
            continue
        actions = {agent: int(rng.integers(14)) for agent in BOTH}
        (seen, *results, infos), (expected, *expected_results, expected_infos) = env.step(actions), plain.step(actions)
        assert results == expected_results
    assert len(outcomes) > 1
    assert directions == {0, 1, 2, 3}


@pytest.mark.parametrize("where", [{"graph": "a"}, {"task": "workshop:4"}])
def test_box_has_the_features_of_its_agent(where):
    env = hierroom.add_features(hierroom.parallel_env(**where), ["goal-status"], "meta_0")
    env = hierroom.add_features(env, ["previous-action"])
    box, given = hierroom.box_view(env), env.observation_space("meta_0")
    observations, _ = env.reset(seed=0)
    rows = {}
    for agent in BOTH:
        values = env.observation_space(agent)["features"].nvec - 1
        rows[agent] = [
            box._boxes.vector(agent, {**observations[agent], "features": features})
            for features in (np.zeros_like(values), values)
        ]
        assert (rows[agent][0] != rows[agent][1]).sum() == 2 * len(values)  # the 1 of each feature moves
    assert len(rows["meta_0"][0]) == len(rows["controller_0"][0])
    assert given["features"].nvec.sum() > env.observation_space("controller_0")["features"].nvec.sum()


def make_aec(**settings):
    return hierroom.box_view(hierroom.env(**{"graph": "a", "size": 11, "max_steps": 60, **settings}))


# Its checkers warn of a dict with a mask, which PettingZoo proposes, and reset with an option that no environment has.
@pytest.mark.filterwarnings("error", "ignore:Observation:UserWarning", "ignore:a reset takes:UserWarning")
@pytest.mark.parametrize("drop_key", [False, True])
def test_box_views_pass_pettingzoo_checkers(drop_key, capsys):
    parallel_api_test(make(drop_key=drop_key), num_cycles=200)
    parallel_seed_test(lambda: make(drop_key=drop_key), num_cycles=200)
    api_test(make_aec(drop_key=drop_key), num_cycles=200)
    seed_test(lambda: make_aec(drop_key=drop_key), num_cycles=200)


@pytest.mark.parametrize("drop_key", [False, True])
def test_aec_boxes_and_masks_equal_the_dicts(drop_key):
    """Play next to the dicts, with legal and illegal actions."""
    settings = {"drop_key": drop_key, "goal_mask": "existing", "subgoal_horizon": 5, "reward": "bonus"}
    env, plain = make_aec(**settings), hierroom.raw_env(graph="a", size=11, max_steps=60, **settings)
    assert env.observation_space("meta_0") == env.observation_space("controller_0")
    rng, n_illegal = np.random.default_rng(0), 0
    for episode in range(4):
        seed = 7 if episode == 0 else None
        env.reset(seed=seed)
        plain.reset(seed=seed)
        for agent in plain.agent_iter():
            assert env.agent_selection == agent
            (seen, *results), (expected, *expected_results) = env.last(), plain.last()
            assert results == expected_results
            assert env.observation_space(agent).contains(seen)
            np.testing.assert_allclose(seen["observation"], numbers(agent, expected), atol=1e-6)
            mask = expected["action_mask"].tolist()
            assert seen["action_mask"].tolist() == [*mask, *[0] * (14 - len(mask))]
            action = None if results[1] or results[2] else int(rng.integers(14))
            env.step(action)
            plain.step(action)
        n_illegal += expected_results[3]["illegal_actions"]
    assert n_illegal > 0


@pytest.mark.parametrize("make", [hierroom.env, hierroom.parallel_env])
@pytest.mark.parametrize(
    "view",
    [hierroom.box_view, lambda env: hierroom.add_features(env, ["view"]), lambda env: env],
    ids=["boxes", "features", "plain"],
)
def test_space_attributes_belong_to_the_view(make, view):
    """Libraries such as skrl read these; without them, a wrapper would show those of the wrapped environment."""
    env = view(make(graph="a", size=11))
    for agent in BOTH:
        assert env.observation_spaces[agent] is env.observation_space(agent)
        assert env.action_spaces[agent] is env.action_space(agent)
