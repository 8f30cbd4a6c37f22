"""Actions that are arrays, in every API: Box, MultiDiscrete and MultiBinary."""

import numpy as np
import pytest
from dial_tasks import SPACES, Dials, dials
from gymnasium import spaces

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.actions import DiscreteActions, actions_of

EVERY = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)


@EVERY
def test_all_apis_take_the_same_steps(space):
    task, entries = dials(space), {"reward": "extrinsic"}
    envs = EscapeRooms(3, task, **entries)
    alone, both = EscapeRoom(task, env_index=1, **entries), hierroom.parallel_env(task, env_index=1, **entries)
    observations, _ = envs.reset(seed=1)
    shown = [alone.reset(seed=1)[0], both.reset(seed=1)[0]["controller_0"]]
    envs.action_space.seed(0)
    for _ in range(12):
        assert envs.observation_space.contains(observations)
        assert "action_mask" not in shown[0]
        for one in shown:
            np.testing.assert_array_equal(observations["observation"][1], one["observation"])
        actions = envs.action_space.sample()
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        one, reward, *ends, info = alone.step(actions[1])
        others, rewards_by_agent, *_ = both.step({"meta_0": 1, "controller_0": actions[1]})
        shown = [one, others["controller_0"]]
        assert rewards[1] == reward == rewards_by_agent["controller_0"]
        assert (infos["illegal_actions"][1], info["illegal_actions"]) == (0, 0)
        if any(ends):
            assert (terminated[1], truncated[1]) == tuple(ends)
            break


@pytest.mark.parametrize("make", [hierroom.env, hierroom.parallel_env])
def test_box_view_refuses_arrays_in_one_line(make):
    with pytest.raises(InputError, match=r"^box_view takes Discrete actions, not MultiBinary\(.*\)$"):
        hierroom.box_view(make(dials(SPACES["binary"])))


def test_actions_outside_are_clipped_or_cost_the_step():
    turns = Turns(hierroom.EnvConfig(task=dials(SPACES["box"])), 3, seed=0)
    step = turns.step([[9, -1], [np.nan, 0], [0.25, np.inf]])
    np.testing.assert_array_equal(step.actions, np.float32([[2, 0], [np.nan, 0], [0.25, 0.5]]))
    assert (step.illegal_actions.tolist(), step.extrinsic.tolist()) == ([0, 1, 0], [0.5, 0, 0.78125])
    turns = Turns(hierroom.EnvConfig(task=dials(SPACES["multi"])), 2, seed=0)
    step = turns.step([[3, 1, 2], [0, 1, 2]])  # the first number begins at 1
    assert (step.illegal_actions.tolist(), step.extrinsic.tolist()) == ([0, 1], [1, 0])


@pytest.mark.parametrize("api", ["env", "parallel_env"])
@pytest.mark.parametrize(("space", "wrong"), [("box", [1.0]), ("box", 1), ("box", "up"), ("multi", [1.5, 0, 0])])
def test_wrong_arrays_are_refused_in_one_line(api, space, wrong):
    env = getattr(hierroom, api)(dials(SPACES[space]))
    env.reset(seed=0)
    if api == "env":
        env.step(0)
    with pytest.raises(InputError) as refused:
        env.step(wrong if api == "env" else {"meta_0": 0, "controller_0": wrong})
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("actions must be 1 of ")


@pytest.mark.parametrize(
    ("space", "said"),
    [
        (spaces.Dict({"move": spaces.Discrete(2)}), "must be Discrete, MultiDiscrete, MultiBinary or Box, not Dict("),
        (spaces.Tuple([spaces.Discrete(2)]), "must be Discrete, MultiDiscrete, MultiBinary or Box, not Tuple("),
        (spaces.Box(-np.inf, 1, (2,)), "have no scale, as their bounds are not finite"),
        (spaces.Box(-np.inf, np.inf, (2,), np.float64), "give it bounds: gymnasium.wrappers.TransformAction("),
        (spaces.Box(-1e308, 1e308, (2,), np.float64), "have no scale"),
        (spaces.Box(-np.inf, np.inf, (2,), np.int64), "have no scale"),
        (spaces.Discrete(200, start=100, dtype=np.uint8), "the largest action of dials is 299, but uint8 holds 255"),
        (spaces.MultiDiscrete([2, 200], np.uint8, start=[0, 100]), "the largest action of dials is 299"),
        (spaces.Box(0, 1, (2,), bool), "Box actions of dials must be numbers, not bool"),
        (spaces.Box(0, 1, (0,)), "need 1 to 65536 outputs of a policy, not 0"),
    ],
)
def test_other_action_spaces_are_refused_in_one_line(space, said):
    def make():
        env = Dials(SPACES["box"])
        env.action_space = space
        return env

    with pytest.raises(InputError) as refused:
        hierroom.env(hierroom.Task(make, label="dials"))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("space", [spaces.Box(-1, 1, (2,), np.int8), spaces.MultiDiscrete([3, 3], start=[-1, -1])])
def test_random_actions_are_equally_likely(space):
    drawn = actions_of(space, "a task", 256).sample(np.random.default_rng(0), 6_000)
    counts = np.stack([np.sum(drawn == number, axis=0) for number in (-1, 0, 1)])
    assert (abs(counts - 2_000) < 200).all()


@pytest.mark.parametrize(
    "space",
    [
        spaces.MultiDiscrete([255, 255], np.uint8, start=[0, 1]),
        spaces.MultiDiscrete([127, 2], np.int8, start=[-128, 126]),
        spaces.MultiDiscrete([[300], [2]], np.int16, start=[[-7], [3]]),
    ],
)
def test_numbers_outside_stay_illegal_in_every_type(space):
    kind, last = actions_of(space, "a task", 256), np.asarray(space.start, int) + space.nvec - 1
    assert kind.are_legal(kind.read([space.start, last], 2)).all()
    outside = [space.start - np.int64(1), last + 1, last + 256, space.start - np.int64(256)]
    assert not kind.are_legal(kind.read(outside, 4)).any()
    assert DiscreteActions(3, 2**40).name(np.int32(1)) == f"action {2**40 + 1}"


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.float16, np.float64])
@pytest.mark.parametrize("shape", [(), (2, 3)])
def test_policy_reaches_both_bounds_of_every_type(dtype, shape):
    space = spaces.Box(0, 127, shape, dtype)
    kind = actions_of(space, "a task", 256)
    acts = kind.for_envs(kind.of_policy(np.full((3, len(kind.sizes)), [[-9.0], [0.0], [9.0]], np.float32)))
    assert all(space.contains(act) for act in acts)
    assert [float(act.mean()) for act in acts[::2]] == [0, 127]
