"""The environments of every API take a task, and pass the checkers of PettingZoo and Gymnasium."""

import chest_task
import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np
import pytest
from dial_tasks import SPACES, dials
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test, seed_test

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms


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
