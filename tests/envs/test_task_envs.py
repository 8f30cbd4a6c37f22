"""The environments of every API take a task, also one with arrays as actions, and pass the libraries' checkers."""

import chest_task
import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np
import pytest
from dial_tasks import SPACES, Dials, dials
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test, seed_test

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.actions import DiscreteActions, actions_of


def holds(kind):
    return lambda env, info: env.unwrapped.carrying is not None and env.unwrapped.carrying.type == kind


unlock = hierroom.Task(
    make=lambda: gymnasium.make("MiniGrid-UnlockPickup-v0"),
    goals={"key": holds("key"), "box": holds("box")},
    rules={"key": {}, "box": {"needs": "key"}},
    target="box",
    max_steps=60,
)
TASKS = {name: getattr(chest_task, name) for name in ("chest", "free", "lake", "taxi", "pole", "balance")}
TASKS["unlock"] = unlock


@pytest.fixture(params=TASKS)
def task(request):
    return TASKS[request.param]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("task", [*TASKS.values(), *map(dials, SPACES.values())], ids=[*TASKS, *SPACES])
def test_task_environments_pass_the_api_checkers(task):
    api_test(hierroom.env(task), num_cycles=40)
    parallel_api_test(hierroom.parallel_env(task), num_cycles=40)
    seed_test(lambda: hierroom.env(task), num_cycles=20)
    check_env(EscapeRoom(task, meta="fixed-dfs"), skip_render_check=True)


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_vector_of_a_task_equals_single_environment(mode, task):
    envs = EscapeRooms(3, task, meta="fixed-dfs", max_steps=20, autoreset_mode=mode)
    alone = EscapeRoom(task, meta="fixed-dfs", max_steps=20, env_index=1)
    observations, _ = envs.reset(seed=1)
    one, _ = alone.reset(seed=1)
    rng = np.random.default_rng(0)
    for _ in range(15):
        assert envs.observation_space.contains(observations)
        flat, flat_one = (spaces.flatten(alone.observation_space, row) for row in (nth(observations, 1), one))
        np.testing.assert_array_equal(flat, flat_one)
        actions = rng.integers(envs.single_action_space.n, size=3)
        observations, rewards, *ends, _ = envs.step(actions)
        one, reward, *ended, _ = alone.step(actions[1])
        assert (rewards[1], [end[1] for end in ends]) == (reward, ended)
        if any(ended):
            break


def nth(observations, env):
    return {name: values[env] for name, values in observations.items()}


def test_gymnasium_make_takes_a_task_name():
    env = gymnasium.make("hierroom/Task-v0", task="chest_task:chest", meta="fixed-dfs")
    observation, info = env.reset(seed=0)
    assert observation["goal"].tolist() in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    assert {*observation} == {"held_coins", "held_key", "observation_goal", "picture", "place", "goal", "action_mask"}
    assert info["shortest_length"] == -1
    envs = gymnasium.make_vec("hierroom/Task-v0", num_envs=2, task="chest_task:chest")
    assert envs.reset(seed=0)[0]["picture"].shape == (2, 5, 7, 3)
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(InputError, match=r"a task is a name, .* not ''"):
            make("hierroom/Task-v0")


@pytest.mark.parametrize("task", [chest_task.chest, chest_task.split], ids=["same process", "other processes"])
def test_render_shows_the_environment_and_the_goals(task):
    env = hierroom.env(task, render_mode="rgb_array")
    env.reset(seed=0)
    env.step(1)
    drawn = np.full(3, 40 * (1 + int(env.observe("controller_0")["place"])))
    picture = env.render()
    assert (picture == drawn).all(axis=2).any()  # the frame of the environment, left of the panel with the goals
    env.close()
    envs = EscapeRooms(2, task, render_mode="rgb_array")
    envs.reset(seed=0)
    assert [one.shape for one in envs.render()] == [picture.shape] * 2
    envs.close()
    text = hierroom.env(chest_task.chest, render_mode="ansi")
    text.reset(seed=0)
    text.step(1)
    assert text.render().splitlines() == ["  [ ] coin", "> [ ] key", "  [ ] chest  <- key"]


class Counted(chest_task.Chest):
    n_open = 0

    def __init__(self):
        super().__init__()
        type(self).n_open += 1

    def close(self):
        type(self).n_open -= 1


@pytest.mark.parametrize("make", [hierroom.env, hierroom.parallel_env, EscapeRoom, lambda task: EscapeRooms(3, task)])
def test_close_closes_the_environments_of_a_task(make):
    task = hierroom.Task(Counted, chest_task.GOALS, target="chest")
    task.trial  # noqa: B018 - it makes two, and closes one or both
    Counted.n_open = 0
    env = make(task)
    assert Counted.n_open in (1, 3)
    env.close()
    assert Counted.n_open == 0


def test_max_episode_steps_cannot_exceed_the_tasks_limit():
    envs = gymnasium.make_vec("hierroom/Task-v0", 1, task="chest_task:chest", max_episode_steps=50)
    assert envs.spec.max_episode_steps == chest_task.chest.max_steps == 30


def test_task_complexity_follows_its_rules():
    env = hierroom.env(chest_task.chest).unwrapped
    assert env.complexity.expected_steps == hierroom.complexity.analyze(chest_task.chest.rules).expected_steps
    assert hierroom.env(chest_task.free).unwrapped.complexity is None


def test_library_views_take_or_refuse_a_task():
    parallel, aec = (hierroom.box_view(make(chest_task.taxi)) for make in (hierroom.parallel_env, hierroom.env))
    parallel_api_test(parallel, num_cycles=30)
    api_test(aec, num_cycles=30)
    observations, _ = parallel.reset(seed=0)
    assert observations["meta_0"].shape == observations["controller_0"].shape == (500 + 2 + 4 + 6 + 1,)
    sb3 = hierroom.sb3_view(EscapeRooms(2, chest_task.chest))
    assert sb3.reset()["picture"].shape == (2, 5, 7, 3)
    while not (ended := sb3.step([0, 0]))[2].any():  # to the left, into the pit
        pass
    assert not any(info.get("is_success") for info in ended[3])
    featured = hierroom.add_features(EscapeRoom(chest_task.chest), ["goal-status", "previous-action"])
    assert featured.reset(seed=0)[0]["features"].shape == (4,)
    with pytest.raises(InputError, match="minigrid_view shows levels of EscapeRooms; chest_task:chest has none"):
        hierroom.minigrid_view(EscapeRoom(chest_task.chest))


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
