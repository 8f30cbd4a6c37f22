"""Environments can be pickled, copied and sent to other processes; each copy continues like the original."""

import copy
import multiprocessing
import pickle

import chest_task
import gymnasium
import numpy as np
import pygame
import pytest
from api_kinds import KINDS, actions, begin
from children import TIMES_QUIET
from minigrid.wrappers import ImgObsWrapper
from plain_values import plain

import hierroom
from hierroom import InputError

COPIES = {"pickle": lambda env: pickle.loads(pickle.dumps(env)), "deepcopy": copy.deepcopy}


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_before", [None, 0, 31])
def test_copy_continues_like_the_original(kind, how, n_before):
    """Copy before the first reset, after it, and after 31 steps, which is about one episode."""
    make, play = KINDS[kind]
    env = make()
    if n_before is None:
        twin = COPIES[how](env)
        begin(env)
        begin(twin)
    else:
        begin(env)
        for _ in play(env, actions(n_before)):
            pass
        twin = COPIES[how](env)
    after = actions(40, seed=1)
    ours = [plain(results) for results in play(env, after)]
    assert plain(list(play(twin, after))) == ours  # only now, to show that it shares nothing with the original
    assert len({str(results) for results in ours}) > 1


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("kind", ["aec", "parallel"])
def test_copies_do_not_share_the_spaces(kind, how):
    env = KINDS[kind][0]()
    twin = COPIES[how](COPIES[how](env))
    for agent in env.possible_agents:
        assert twin.action_space(agent) is twin.unwrapped.action_spaces[agent] is not env.action_space(agent)
        assert twin.observation_space(agent) is twin.unwrapped.observation_spaces[agent]


@pytest.mark.parametrize("how", COPIES)
def test_task_in_other_processes_refuses_copies(how):
    env = hierroom.parallel_env(chest_task.split)
    env.reset(seed=3)
    with pytest.raises(InputError, match=r"^environments in other processes cannot be copied"):
        COPIES[how](env)
    observations, *_ = env.step({"meta_0": 0, "controller_0": 1})
    assert observations["controller_0"]["place"] in (1, 3)
    env.close()


@pytest.mark.parametrize("kind", ["gymnasium", "aec", "parallel"])
def test_copies_do_not_share_the_window(kind, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    make, play = KINDS[kind]
    env = make(render_mode="human")
    begin(env)
    for copied in COPIES.values():
        twin = copied(env)
        assert twin.unwrapped.single._screen._window._screen is None
        assert plain(list(play(copied(twin), actions(2)))) == plain(list(play(copied(env), actions(2))))
    assert pygame.display.get_surface() is not None
    env.close()


def in_another_process(kind, env, seed, results):
    results.put([plain(one) for one in KINDS[kind][1](env, actions(20, seed))])


@pytest.mark.slow
def test_spawned_process_continues_the_episode():
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    env = KINDS["parallel"][0]()
    begin(env)
    env.step({"meta_0": 0, "controller_0": 1})
    process = context.Process(target=in_another_process, args=("parallel", env, 5, results))
    process.start()
    there = results.get(timeout=TIMES_QUIET * 20)
    process.join()
    assert there == [plain(one) for one in KINDS["parallel"][1](env, actions(20, 5))]


@pytest.mark.slow
def test_cloudpickle_sends_functions_that_use_the_package():
    """Gymnasium's async vector, Stable-Baselines3 and Ray use cloudpickle."""
    make = KINDS["gymnasium"][0]
    envs = gymnasium.vector.AsyncVectorEnv([lambda: ImgObsWrapper(hierroom.minigrid_view(make()))] * 2, context="spawn")
    observations, _ = envs.reset(seed=[3, 3])
    envs.close()
    expected, _ = hierroom.minigrid_view(make()).reset(seed=3)
    np.testing.assert_array_equal(observations, [expected["image"]] * 2)
    assert copy.deepcopy(hierroom) is hierroom
