"""The learner's features in every API: they equal the learner's input, and levels keep only requested memories."""

import gymnasium
import numpy as np
import pytest
from escape_room import FEATURES, WORLD
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from pettingzoo.test import api_test, parallel_api_test

import hierroom
from hierroom.agents.features import Features
from hierroom.meta import FixedDFS, take_turn
from hierroom.turns.records import AGENTS, CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.layout import MEMORIES

NAMES = ["goal-place", "doorway-places", "frontier-places", "previous-action", "goal-status"]
SETTINGS = {"graph": "d", "size": 13, "max_steps": 60, "goal_mask": "existing", "subgoal_horizon": 9}
ACTIONS = np.random.default_rng(0).integers(5, size=200)
WAIT = 13
add = hierroom.add_features


def expected(seed, names=NAMES, agent=CONTROLLER):
    features, meta = Features(WORLD, names, agent), FixedDFS()
    turns = Turns(EnvConfig(reward="intrinsic", **SETTINGS), seed=seed, memories=MEMORIES)
    observed = []
    for action in ACTIONS:
        if agent == CONTROLLER:
            take_turn(meta, turns)
        if agent == CONTROLLER or len(turns.due(META)):  # the meta-controller sees them on its turns
            observed.append(features.encode(turns.observe(agent, np.arange(1)))[0].tolist())
        take_turn(meta, turns)
        turns.step([action])
    return observed


def choice(env):
    turns = env.unwrapped.single.turns
    situation = turns.situation(np.arange(1))
    return int(FixedDFS().choose(None, situation.legal, situation)[0])


@pytest.mark.parametrize("agent", AGENTS)
def test_aec_features_equal_the_learners(agent):
    env = add(hierroom.env(**SETTINGS), NAMES, agent)
    env.reset(seed=3)
    observed, left = [], list(ACTIONS)
    while left:
        if env.agent_selection == META:
            ended = env.terminations[META] or env.truncations[META]
            if ended:
                env.reset()
            if agent == META:
                observed.append(env.observe(META)["features"].tolist())
            env.step(choice(env))
        else:
            if agent == CONTROLLER:
                observed.append(env.observe(CONTROLLER)["features"].tolist())
            env.step(left.pop(0))
    assert observed == expected(3, agent=agent)
    assert len(observed) > 15


def test_parallel_features_equal_the_learners():
    env = add(hierroom.parallel_env(**SETTINGS), NAMES)
    observations, _ = env.reset(seed=3)
    without_goal = Features(WORLD, NAMES[1:])
    observed = []
    for action in ACTIONS:
        observed.append(observations[CONTROLLER]["features"][2:].tolist())
        is_turn = env.unwrapped.single.is_meta_turn
        observations, *_ = env.step({META: choice(env) if is_turn else WAIT, CONTROLLER: action})
        if not env.agents:
            observations, _ = env.reset()
    assert observed == expected(3, without_goal.names)  # its goal is chosen in the step itself


def test_gymnasium_features_equal_the_learners():
    env = add(gymnasium.make("hierroom/EscapeRoom-d-v0", meta="fixed-dfs", **rest()), NAMES)
    observation, _ = env.reset(seed=3)
    observed = []
    for action in ACTIONS:
        observed.append(observation["features"].tolist())
        observation, _, terminated, truncated, _ = env.step(action)
        assert observation in env.observation_space
        if terminated or truncated:
            observation, _ = env.reset()
    assert observed == expected(3)


def rest():
    return {name: value for name, value in SETTINGS.items() if name != "graph"}


@pytest.mark.parametrize("mode", AutoresetMode)
def test_vector_features_equal_single_environments(mode):
    """The last observation of an episode has the goal pursued last, as in a single environment."""
    env = add(EscapeRooms(3, meta="fixed-dfs", autoreset_mode=mode, **SETTINGS), NAMES)
    alone = [gymnasium.make("hierroom/EscapeRoom-d-v0", meta="fixed-dfs", env_index=n, **rest()) for n in range(3)]
    theirs = SyncVectorEnv([lambda one=one: add(one, NAMES) for one in alone], autoreset_mode=mode)
    (observations, _), (expected, _) = env.reset(seed=3), theirs.reset(seed=[3] * 3)
    n_goals, n_left = 0, 0
    for t, action in enumerate(ACTIONS):
        np.testing.assert_array_equal(observations["features"], expected["features"])
        if mode == AutoresetMode.DISABLED and t % 60 == 0 and t:
            for mask in (np.array([True, True, False]), np.array([False, False, True])):  # one still shows its end
                np.testing.assert_array_equal(observations["features"], expected["features"])
                (observations, _), (expected, _) = (one.reset(options={"reset_mask": mask}) for one in (env, theirs))
            np.testing.assert_array_equal(observations["features"], expected["features"])
            n_left += 1
        observations, _, terminated, truncated, infos = env.step(np.full(3, action))
        expected, *_, expected_infos = theirs.step(np.full(3, action))
        assert env.observation_space["features"].contains(observations["features"])
        for n in np.flatnonzero(terminated | truncated):
            last, expected_last = observations, expected
            if mode == AutoresetMode.SAME_STEP:
                last, expected_last = infos["final_obs"][n], expected_infos["final_obs"][n]
                np.testing.assert_array_equal(last["features"], expected_last["features"])
            n_goals += last["goal"].any()
    assert n_goals >= 6
    assert n_left == (3 if mode == AutoresetMode.DISABLED else 0)


@pytest.mark.filterwarnings(
    "ignore:Observation space for each agent probably should be:UserWarning",  # they are dicts with a mask
    "ignore:Agents have different observation space sizes:UserWarning",
    "ignore:Observation is not a NumPy array:UserWarning",
    r"ignore:.*is different from the unwrapped version:UserWarning",  # it is wrapped on purpose
)
def test_environments_with_features_pass_the_checkers():
    for trained in map(hierroom.load, ("d", "learned-g")):
        api_test(add(hierroom.env(**SETTINGS), trained), 100)
        parallel_api_test(add(hierroom.parallel_env(**SETTINGS), trained), 100)
    for agent in AGENTS:
        names = [name for name in FEATURES if agent == META or name != "goal-outcome"]
        api_test(add(hierroom.env(**SETTINGS), names, agent), 300)
        parallel_api_test(add(hierroom.parallel_env(**SETTINGS), names, agent), 300)
    check_env(add(gymnasium.make("hierroom/EscapeRoom-c-v0"), names[:-1]), skip_render_check=True)


@pytest.mark.parametrize(("name", "memory"), [("doorway-places", "doorways"), ("frontier-places", "explored")])
def test_levels_keep_only_the_requested_memories(name, memory):
    env = gymnasium.make("hierroom/EscapeRoom-d-v0", meta="oracle")
    levels = env.unwrapped.single.turns.world.state.levels
    env.reset(seed=0)
    assert not any(levels[other].any() for other in MEMORIES)
    env = add(env, [name])
    env.reset(seed=0)
    for action in np.tile([0, 1, 0, 2, 0, 3, 4], 60):
        env.step(action)
    assert levels["remembers"][0] == MEMORIES[memory]
    assert not any(levels[other].any() for other in MEMORIES if other != memory)


@pytest.mark.parametrize("make", [hierroom.env, hierroom.parallel_env])
def test_each_agent_can_have_its_own_features(make):
    env = add(add(make(**SETTINGS), ["view"], META), ["goal-place"], CONTROLLER)
    result = env.reset(seed=1)
    for agent in AGENTS:
        space = env.observation_space(agent)
        observation = env.observe(agent) if result is None else result[0][agent]
        assert space.contains(observation)
        names = ["view" if agent == META else "goal-place"]
        assert space["features"].nvec.tolist() == list(Features(WORLD, names, agent).cardinalities)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: add(gymnasium.make("CartPole-v1"), ["view"]), "takes an environment of hierroom, not"),
        (lambda: add(hierroom.env(), ["smell"]), "features are view, view-ids, .*; not smell"),
        (lambda: add(hierroom.env(), ["view"], "me"), "agent must be meta_0 or controller_0 in this environm"),
        (lambda: add(EscapeRooms(), ["view"], META), "agent must be controller_0 in this"),
        (lambda: add(hierroom.env("a"), hierroom.load("a"), META), "agent goes with names of features"),
        (lambda: add(EscapeRooms(1, "a"), hierroom.load("a"), seed=1), "seed is for the meta-controller of"),
        (lambda: add(hierroom.box_view(hierroom.env()), ["view"]), "that are dicts, before other wrappers, not to"),
        (lambda: add(add(hierroom.env(), ["goal"]), ["view"]), "have features already"),
        (lambda: hierroom.box_view(gymnasium.make("CartPole-v1")), "box_view takes a hierroom.env or a hierroom.paral"),
    ],
)
def test_invalid_uses_raise_input_error(make, said):
    with pytest.raises(hierroom.InputError, match=said) as caught:
        make()
    assert "\n" not in str(caught.value)
