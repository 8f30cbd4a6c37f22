"""Other attributes that libraries use: masks, state, specs."""

import gymnasium
import pytest

from hierroom import InputError
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms

ID = "hierroom/EscapeRoom-b-v0"


@pytest.mark.parametrize("drop_key", [False, True])
def test_action_masks_method_equals_the_observed_mask(drop_key):
    env = gymnasium.make(ID, size=11, drop_key=drop_key)
    observation, _ = env.reset(seed=0)
    masks = env.get_wrapper_attr("action_masks")()
    assert masks.dtype == bool
    assert masks.tolist() == observation["action_mask"].astype(bool).tolist() == [True] * (5 + drop_key)


def test_spec_has_the_step_limit():
    env = gymnasium.make(ID, max_steps=77)
    assert env.spec.max_episode_steps == 77
    assert env.unwrapped.spec.max_episode_steps == 77
    assert gymnasium.make_vec(ID, 2, max_steps=77).spec.max_episode_steps == 77
    assert EscapeRoom("f").spec is EscapeRooms(2, "f").spec is None
    again = gymnasium.make(env.spec)
    assert again.spec.max_episode_steps == 77
    assert '"max_episode_steps": 77' in env.spec.to_json()
    again.reset(seed=0)
    ends = [again.step(1)[2:4] for _ in range(77)]
    assert ends == [(False, False)] * 76 + [(False, True)]


def test_make_vec_takes_specs_and_the_smaller_limit():
    single = gymnasium.make(ID, max_steps=7)
    many = gymnasium.make_vec(ID, 2, max_steps=7)
    shorter = gymnasium.make_vec(ID, 2, max_episode_steps=7)
    longer = gymnasium.make_vec(ID, 2, max_steps=7, max_episode_steps=9)
    for envs in (gymnasium.make_vec(single.spec, 2), gymnasium.make_vec(many.spec), shorter, longer):
        assert envs.spec.max_episode_steps == 7
        envs.reset(seed=0)
        assert [envs.step([1, 1])[3].all() for _ in range(7)] == [False] * 6 + [True]
    for wrong in (0, "7", 7.0):
        with pytest.raises(InputError, match="max_episode_steps must be"):
            gymnasium.make_vec(ID, 2, max_episode_steps=wrong)
