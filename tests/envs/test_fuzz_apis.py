"""The short forms of the fuzzer of the APIs and of the state machine that plays two of them side by side."""

import numpy as np
import pytest
from fuzz import apis

import hierroom
from hierroom import InputError
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms


@pytest.mark.parametrize("name", apis.APIS)
def test_wrong_uses_end_in_one_line(name):
    wrong = [(tried, problem) for tried, problem in apis.problems(name, 60, 20) if problem is not None]
    assert wrong == []


def test_aec_and_parallel_environment_agree_whatever_is_called():
    apis.play_side_by_side(8)


@pytest.mark.parametrize("api", [hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"goal_mask": np.zeros(2)}, "goal_mask is one of reachable, existing, seen, none, not a ndarray"),
        ({"levels": np.zeros(2)}, "levels are training, evaluation or None, not a ndarray"),
        ({"render_mode": np.zeros(2)}, "render_mode"),
        ({"graph": "9" * 5000}, "a graph must be a letter from a to g"),
        ({"graph": 10**5000}, "a graph must be a letter from a to g"),
        ({"env_index": 10**5000}, "env_index must be a whole number of at least 0, not a huge int"),
        ({"novelty_bonus": 1e308}, "novelty_bonus must be a number from 0 to 1,000,000, not 1e+308"),
        ({"novelty_bonus": 10**400}, "novelty_bonus must be a number from 0 to 1,000,000, not 1000"),
        ({"novelty_bonus": np.zeros((2, 9))}, "novelty_bonus must be a number from 0 to 1,000,000, not a ndarray"),
    ],
)
def test_odd_arguments_are_one_clear_line(api, arguments, said):
    with pytest.raises(InputError) as caught:
        api(**arguments)
    assert str(caught.value).startswith(said)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) <= 1000


@pytest.mark.parametrize(
    ("attempt", "said"),
    [
        (lambda: hierroom.parallel_env().step({}), "reset the environment before its first step"),
        (lambda: hierroom.raw_env().step(0), "reset the environment before its first step"),
        (lambda: hierroom.raw_env().last(), "reset the environment before its first step"),
        (lambda: hierroom.raw_env().observe("meta_0"), "reset the environment before its first step"),
        (lambda: hierroom.raw_env().agent_iter(), "reset the environment before its first step"),
        (lambda: began(hierroom.parallel_env()).step([0, 1]), "actions are a dict by agent, not a list"),
        (lambda: hierroom.parallel_env().reset(np.array(3)), "a seed must be a whole number from 0 to 2**63 - 1"),
        (lambda: EscapeRoom().reset(seed=[1]), "a seed must be a whole number from 0 to 2**63 - 1, not a list"),
        (lambda: EscapeRooms(1).reset(seed=b"a"), "a seed must be a whole number from 0 to 2**63 - 1, not b'a'"),
        (lambda: EscapeRooms(2).reset(seed=np.array(0.5)), "a seed must be a whole number from 0 to 2**63 - 1"),
        (lambda: EscapeRooms(2, autoreset_mode=np.ones(2)), "autoreset_mode must be one of NextStep, SameStep, Dis"),
        (lambda: EscapeRooms(2, copy=np.zeros(2)), "copy must be True or False, not a ndarray"),
        (lambda: EscapeRooms(2, meta=np.zeros(2)), "a meta-controller has a method choose(observations, legal, situ"),
        (lambda: EscapeRooms(2, flat="no"), "flat must be True or False, not 'no'"),
    ],
)
def test_odd_calls_are_one_clear_line(attempt, said):
    with pytest.raises(InputError) as caught:
        attempt()
    assert str(caught.value).startswith(said)


def began(env):
    env.reset(seed=0)
    return env


def test_a_seed_of_numpy_is_a_seed_in_every_api():
    for make in (hierroom.parallel_env, EscapeRoom):
        (first, _), (second, _) = (make().reset(seed=seed) for seed in (3, np.int8(3)))
        assert repr(first) == repr(second)
