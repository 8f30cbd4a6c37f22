"""Checks of the results of `reset` and `step` of a user's environment."""

import math

import numpy as np
import pytest
import torch

from hierroom.support.env_results import reset_results, step_results
from hierroom.support.errors import InputError

TUPLE = "step of task must return a tuple (observation, reward, terminated, truncated, info), not "
REWARD, ENDS = "step of task must return a finite number as reward, not ", "step of task must return True or False as "


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        *[({"reward": one}, REWARD + repr(one)) for one in ("1.5", b"1", None, 1j, math.nan, -math.inf)],
        *[({"reward": one}, f"{REWARD}a {type(one).__name__}") for one in ([], np.ones(1), {})],
        ({"reward": 10**400}, f"{REWARD}1000"),
        *[({"terminated": one}, f"{ENDS}terminated, not {one!r}") for one in ("False", math.nan, None, 2, 1, 0.0)],
        *[({"truncated": one}, f"{ENDS}truncated, not a {type(one).__name__}") for one in ([False], np.ones(1, bool))],
        ({"info": None}, "step of task must return a dict as info, not None"),
    ],
)
def test_wrong_value_in_one_of_several_environments_raises_input_error(entries, said):
    right = {"observation": 0, "reward": 0.0, "terminated": False, "truncated": False, "info": {}}
    for results in ([right, right | entries, right], [right | entries]):
        with pytest.raises(InputError) as refused:
            step_results([tuple(one.values()) for one in results], "task")
        assert str(refused.value).startswith(said)


@pytest.mark.parametrize(
    ("results", "said"),
    [
        ([(0, 0.0, False, {})], TUPLE + "4 values"),
        ([(0, 0.0, False, False, {}), (0, 0.0, False, {})], TUPLE + "4 values"),
        ([[0, 0.0, False, False, {}]], TUPLE + "a list"),
        ([(0, 0.0, False, False, {}), None], TUPLE + "None"),
    ],
)
def test_wrong_tuple_raises_input_error(results, said):
    with pytest.raises(InputError) as refused:
        step_results(results, "task")
    assert str(refused.value) == said
    for one, words in (((0, {}, {}), "3 values"), (np.zeros(2), "a ndarray"), ({}, "a dict")):
        with pytest.raises(
            InputError, match=rf"^reset of task must return a tuple \(observation, info\), not {words}$"
        ):
            reset_results([(0, {}), one], "task")


def test_numbers_and_flags_of_any_type_are_taken():
    rewards = [1, 1.0, True, np.float32(1), np.int8(1), np.array(1.0), torch.tensor(1.0), 2**63]
    flags = [True, np.True_, np.array(True), torch.tensor(True)] * 2
    taken = step_results([(0, one, flag, False, {}) for one, flag in zip(rewards, flags, strict=True)], "task")
    assert taken.rewards.tolist() == [1.0] * 7 + [2.0**63]
    assert (taken.rewards.dtype, taken.terminated.tolist(), taken.truncated.any()) == (np.float64, [True] * 8, False)
