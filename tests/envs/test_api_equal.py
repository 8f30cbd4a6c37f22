"""With the same seed and actions, all APIs give the same as the batch of turns, step for step."""

import itertools

import numpy as np
import pytest
from api_scripts import Script, record, same
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

AGENTS = ("meta_0", "controller_0")
SEED = 5
REWARDS = ("intrinsic", "extrinsic", "bonus")
MASKS = ("reachable", "existing", "seen", "none", "reachable")
CASES = [
    EnvConfig(graph, size=11, max_steps=90, drop_key=drop, reward=REWARDS[i % 3], **own, goal_mask=MASKS[i % 5])
    for i, (graph, drop, own) in enumerate(itertools.product("abcdefg", (False, True), ({}, {"subgoal_horizon": 7})))
]


@pytest.fixture(
    scope="module", params=CASES, ids=lambda c: f"{c.graph}{c.drop_key:d}-{c.reward}-{c.goal_mask}-{c.subgoal_horizon}"
)
def case(request):
    return request.param, record(request.param)


def keywords(config, **changes):
    return {**vars(config), **changes}


def test_recorded_plays_cover_choices_ends_rewards_and_illegal_actions(case):
    _, plays = case
    moments = [moment for play in plays for moment in play]
    assert sum(moment.meta is not None for moment in moments) > 8
    assert any(moment.ends[0] or moment.ends[1] for moment in moments)
    assert any(moment.rewards["controller_0"] for moment in moments)
    assert all(any(m.infos[agent]["illegal_actions"] for m in moments) for agent in AGENTS)


def is_legal(moment):
    return -1 <= moment.choice < 14 and moment.meta["action_mask"][13 if moment.choice == -1 else moment.choice] == 1


def test_the_aec_environment_equals_the_batch_of_turns(case):
    config, plays = case
    for n, play in enumerate(plays):
        env = hierroom.raw_env(**keywords(config, env_index=n))
        env.reset(seed=SEED)
        illegal = 0
        for moment in play:
            if moment.meta is not None:
                illegal += not is_legal(moment)
                assert env.agent_selection == "meta_0"
                same(env.observe("meta_0"), moment.meta)
                env.step(moment.choice)
                assert env.rewards == {"meta_0": 0.0, "controller_0": 0.0}
            assert env.agent_selection == "controller_0"
            same(env.observe("controller_0"), moment.controller)
            env.step(moment.action)
            for agent in AGENTS:
                assert env.rewards[agent] == moment.rewards[agent]
                assert (env.terminations[agent], env.truncations[agent]) == moment.ends
            same(env.infos["controller_0"], moment.infos["controller_0"])
            if env.agent_selection == "meta_0":
                same(env.infos["meta_0"], moment.infos["meta_0"] | {"illegal_actions": illegal})
            if any(moment.ends):
                for agent in AGENTS:
                    same(env.observe(agent), moment.finals[agent])
                    env.step(None)
                assert env.agents == []
                env.reset()
                illegal = 0


def test_the_parallel_environment_equals_the_batch_of_turns(case):
    config, plays = case
    for n, play in enumerate(plays):
        env = hierroom.parallel_env(**keywords(config, env_index=n))
        observations, _ = env.reset(seed=SEED)
        for moment in play:
            if moment.meta is None:
                same(observations["controller_0"], moment.controller)
                assert observations["meta_0"]["action_mask"].tolist() == [0] * 13 + [1]
            else:
                same(observations["meta_0"], moment.meta)
                assert not observations["controller_0"]["goal"].any()  # it has not been chosen yet
                same(observations["controller_0"] | {"goal": moment.controller["goal"]}, moment.controller)
            observations, rewards, terminations, truncations, infos = env.step(
                {"meta_0": moment.choice, "controller_0": moment.action}
            )
            for agent in AGENTS:
                assert rewards[agent] == moment.rewards[agent]
                assert (terminations[agent], truncations[agent]) == moment.ends
                same(infos[agent], moment.infos[agent])
            if any(moment.ends):
                for agent in AGENTS:
                    same(observations[agent], moment.finals[agent])
                assert env.agents == []
                observations, _ = env.reset()


def test_the_gymnasium_environment_equals_the_batch_of_turns(case):
    config, plays = case
    for n, play in enumerate(plays):
        env = EscapeRoom(**keywords(config, env_index=n, meta=Script(plays)))
        observation, _ = env.reset(seed=SEED)
        for moment in play:
            same(observation, moment.controller)
            observation, reward, terminated, truncated, info = env.step(moment.action)
            assert (reward, (terminated, truncated)) == (moment.rewards["controller_0"], moment.ends)
            same(info, moment.infos["controller_0"])
            if any(moment.ends):
                same(observation, moment.finals["controller_0"])
                observation, _ = env.reset()


@pytest.mark.parametrize("mode", AutoresetMode)
def test_vector_env_equals_gymnasiums_sync_vector_env(case, mode):
    """Replay the recorded episodes in same-step mode; in other modes use the choices of Gymnasium's environment."""
    config, plays = case
    n = len(plays)
    metas = [Script(plays) for _ in range(n + 1)] if mode == AutoresetMode.SAME_STEP else ["fixed-dfs"] * (n + 1)
    ours = EscapeRooms(n, **keywords(config, meta=metas[n], autoreset_mode=mode))
    theirs = SyncVectorEnv(
        [lambda i=i: EscapeRoom(**keywords(config, env_index=i, meta=metas[i])) for i in range(n)], autoreset_mode=mode
    )
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    (observations, infos), (expected, expected_infos) = ours.reset(seed=SEED), theirs.reset(seed=[SEED] * n)
    ended, n_masks = np.zeros(n, bool), 0
    for t in range(len(plays[0])):
        same_deeply(observations, expected)
        same_deeply(infos, expected_infos)
        if mode == AutoresetMode.SAME_STEP:
            for i, play in enumerate(plays):
                same({name: values[i] for name, values in observations.items()}, play[t].controller)
        if mode == AutoresetMode.DISABLED and (ended.any() or t % 60 == 59):
            mask, seeds = (ended if ended.any() else np.arange(n) == 0), [None, 8] if t % 2 else None
            again = [env.reset(seed=seeds, options={"reset_mask": mask.copy()}) for env in (ours, theirs)]
            for one, other in zip(*again, strict=True):
                same_deeply(one, other)
            n_masks += 1
        actions = np.array([play[t].action for play in plays])
        observations, *results, infos = ours.step(actions)
        expected, *expected_results, expected_infos = theirs.step(actions)
        ended = results[1] | results[2]
        for result, expected_result in zip(results, expected_results, strict=True):
            np.testing.assert_array_equal(result, expected_result, strict=True)
    assert mode != AutoresetMode.DISABLED or n_masks > 1


def same_deeply(one, other):
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for name in one:
            same_deeply(one[name], other[name])
    elif one is None or one.dtype != object:
        is_flat = one is not None and one.ndim and one.shape[-1] > 150  # numbers are the same, their type is not
        np.testing.assert_array_equal(one, other, strict=not is_flat)
    else:
        for ours, theirs in zip(one, other, strict=True):
            same_deeply(ours, theirs)
