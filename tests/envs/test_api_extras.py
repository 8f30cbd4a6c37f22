"""Other attributes that libraries use: masks, state, specs."""

import gymnasium
import numpy as np
import pytest
from minigrid.wrappers import FullyObsWrapper

import hierroom
from hierroom import InputError
from hierroom.goals import COLOURS
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


@pytest.mark.parametrize("make", [hierroom.parallel_env, hierroom.env], ids=["parallel", "aec"])
def test_state_equals_minigrids_full_grid(make):
    env = make(graph="b", size=13)
    env.reset(seed=4)
    state = env.state()
    assert env.state_space.contains(state)
    whole = FullyObsWrapper(hierroom.minigrid_view(gymnasium.make(ID, size=13)))
    expected = whole.reset(seed=4)[0]["image"].swapaxes(0, 1)
    np.testing.assert_array_equal(state[..., :2], expected[..., :2])
    is_door, is_agent = expected[..., 0] == 4, expected[..., 0] == 10
    np.testing.assert_array_equal(state[is_agent], np.append(expected[is_agent], [[0]], axis=1))
    assert (state[is_door, 2] == 0).all()  # locked
    assert (state[..., 3] == 0).all()
    turns = env.unwrapped.single.turns
    goal = int(turns.world.state.levels[0].colours[0])
    if make is hierroom.env:
        env.step(goal)
    else:
        env.step({"meta_0": goal, "controller_0": 1})
    ((row, col),) = np.argwhere(env.state()[..., 3])
    assert env.state()[row, col].tolist() == [5, goal, 0, 1]
    assert goal < len(COLOURS)


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


@pytest.mark.parametrize("make", [hierroom.parallel_env, hierroom.env], ids=["parallel", "aec"])
def test_final_state_shows_the_pursued_goal(make):
    env = make(graph="b", size=13, max_steps=2)
    env.reset(seed=4)
    goal = int(env.unwrapped.single.turns.world.state.levels[0].colours[0])
    for actions in ((goal, 1), (13, 1)):
        if make is hierroom.parallel_env:
            env.step(dict(zip(env.possible_agents, actions, strict=True)))
        else:
            for action in actions:
                if env.agent_selection == ("meta_0" if action == actions[0] else "controller_0"):
                    env.step(action)
        assert env.state()[..., 3].sum() == 1
    assert all(env.truncations.values()) if make is hierroom.env else not env.agents
