"""Errors in a user's task, in its results or in its use, raise one-line errors."""

import math
import re

import gymnasium
import numpy as np
import pytest
import torch
from chest_task import GOALS, Chest, chest

import hierroom
from hierroom.support.env_results import reset_results, step_results
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig


def make(task=chest, n=1, seed=0, **settings):
    return Turns(EnvConfig(task=task, **settings), n, seed=seed)


class Untrue(Chest):
    observation_space = gymnasium.spaces.Dict({"hint": gymnasium.spaces.Text(5)})


class Broken(Chest):
    def step(self, action):
        raise ValueError("no\nstep")


class Quitting(Chest):
    def step(self, action):
        raise SystemExit(3)


class Shown(Chest):
    """A chest that shows any given place."""

    def __init__(self, place, **settings):
        super().__init__(**settings)
        self.place = place

    def _observation(self):
        return {**super()._observation(), "place": self.place}


class Seen(Chest):
    """A chest that shows the same array all the time."""

    def __init__(self, shown, high=255, shape=(1,), dtype=np.uint8):
        super().__init__()
        self.shown, self.observation_space = shown, gymnasium.spaces.Box(0, high, shape, dtype)

    def _observation(self):
        return self.shown


class Closing(Chest):
    def close(self):
        raise RuntimeError("no end")


class Manifold(Chest):
    action_space = gymnasium.spaces.Discrete(500)


class Unobserved(Chest):
    observation_space = property()


class Old(Chest):
    def reset(self, **settings):
        return super().reset(**settings)[0]


class Parted(Chest):
    def _observation(self):
        return {name: one for name, one in super()._observation().items() if name != "held"}


ONLY = Chest()


def stops(env, info):
    raise BaseException("stop")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"make": lambda: 1 / 0}, "make of task fails: ZeroDivisionError: division by zero (line "),
        ({"make": lambda: 3}, "make of task must return a gymnasium.Env, not 3"),
        ({"make": "Nowhere-v7"}, "make of task fails: NameNotFound: "),
        ({"make": Untrue}, "observations are Box, Discrete, MultiDiscrete or MultiBinary, or dicts, not Dict("),
        ({"make": lambda: ONLY}, "make of task must return a new environment each time, not always the same one"),
        ({"make": Unobserved}, "make of task fails: AttributeError: "),
        ({"make": Old}, "reset of task must return a tuple (observation, info), not a dict"),
        ({"make": lambda: Shown(5)}, "shows 'place' outside its observation space: 5 in Discrete(6, start=-1)"),
        ({"make": lambda: Shown(1j)}, "shows 'place' outside its observation space: an array of complex128"),
        ({"make": Parted}, "task shows 'held_coins' outside its observation space: KeyError: 'held' in Box("),
        *[
            ({"make": lambda shown=shown: Seen([shown], 1, dtype=bool)}, f"observation space: {text} in Box(")
            for shown, text in ((2, "2"), (0.5, "0.5"), (math.nan, "nan"))
        ],
        (
            {"make": lambda: Seen([2.0**64], dtype=np.uint64)},
            "outside its observation space: 1.8446744073709552e+19",
        ),
        ({"make": lambda: Seen(0.5, 1, (3,), np.float32)}, "an array of float64 and shape () in Box("),
        (
            {"make": lambda: Seen([1e300], np.inf, dtype=np.float32)},
            "task shows 'observation' with 1e+300; a network reads finite numbers up",
        ),
        ({"make": lambda: Seen(None, np.inf, dtype=np.float32)}, "outside its observation space: None in Box("),
        ({"make": Closing}, "close of task fails: RuntimeError: no end (line "),
        ({"make": Manifold}, "a task has at most 255 actions; task has 500"),
        ({"make": Broken}, "step of task fails: ValueError: no step (line "),
        ({"make": Quitting}, "step of task fails: SystemExit: 3 (line "),
        ({"goals": {"chest": stops}}, "goal 'chest' of task fails: BaseException: stop (line "),
        ({"goals": {"chest": lambda env, info: info["cell"]}}, "goal 'chest' of task fails: KeyError: 'cell' (line "),
        ({"goals": {"chest": lambda env: True}}, "goal 'chest' of task fails: TypeError: "),
    ],
)
def test_errors_in_user_code_raise_input_error(changes, said):
    task = hierroom.Task(**{"make": Chest, "goals": GOALS, "target": "chest", **changes})
    with pytest.raises(InputError) as refused:
        make(task)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


class Turning(Seen):
    """A chest that shows two numbers, and whose steps have other results after forty of them."""

    def __init__(self, **later):
        super().__init__(np.zeros(2), np.inf, (2,), np.float64)
        self.later, self.steps = later, 0

    def step(self, action):
        self.steps += 1
        names = ("observation", "reward", "terminated", "truncated", "info")
        results = dict(zip(names, super().step(action), strict=True))
        return tuple((results | self.later if self.steps > 40 else results).values())


def goal_that(value):
    return lambda env, info: env.steps > 40 and value


@pytest.mark.parametrize("processes", [0, 2])
@pytest.mark.parametrize(
    ("later", "goal", "said"),
    [
        ({"observation": np.zeros(3)}, False, "an array of float64 and shape (3,) in Box("),
        ({"observation": None}, False, "task shows 'observation' outside its observation space: None in Box("),
        ({"observation": [1e39, 0]}, False, "task shows 'observation' with 1e+39; a network reads finite numbers up"),
        ({"reward": "1.5"}, False, "step of task must return a finite number as reward, not '1.5'"),
        ({"terminated": "False"}, False, "step of task must return True or False as terminated, not 'False'"),
        ({"info": None}, False, "must return a dict as info, not None"),
        (
            {"more": 1},
            False,
            "step of task must return a tuple (observation, reward, terminated, truncated, info)",
        ),
        ({}, "yes", "goal 'chest' of task must return True, False or a count of at least 0, not 'yes'"),
        ({}, np.ones(2), "goal 'chest' of task must return True, False or a count of at least 0, not a ndarray"),
    ],
)
def test_wrong_results_are_refused_at_any_step_and_in_other_processes(later, goal, said, processes):
    goals = {"chest": goal_that(goal)}
    task = hierroom.Task(make=lambda: Turning(**later), goals=goals, target="chest", processes=processes)
    turns = make(task, 3)
    for _ in range(40):
        turns.step([2] * 3)
    with pytest.raises(InputError, match=re.escape(said)):
        turns.step([2] * 3)
    turns.world.close()


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"size": 13}, "size is for EscapeRooms; chest_task:chest has no such entry"),
        ({"graph": "d"}, "graph is for EscapeRooms"),
        ({"task": 3}, "a task is a name, like package.module:name, or a hierroom.Task, not 3"),
        ({"max_steps": 0}, "max_steps must be a whole number from 1 to 2**62 - 1 or None, not 0"),
    ],
)
def test_task_refuses_entries_of_escape_rooms(entries, said):
    with pytest.raises(InputError) as refused:
        EnvConfig(**{"task": chest, **entries})
    assert said in str(refused.value)


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
    for one, given in (((0, {}, {}), "3 values"), (np.zeros(2), "a ndarray"), ({}, "a dict")):
        with pytest.raises(
            InputError, match=rf"^reset of task must return a tuple \(observation, info\), not {given}$"
        ):
            reset_results([(0, {}), one], "task")


def test_numbers_and_flags_of_any_type_are_taken():
    rewards = [1, 1.0, True, np.float32(1), np.int8(1), np.array(1.0), torch.tensor(1.0), 2**63]
    flags = [True, np.True_, np.array(True), torch.tensor(True)] * 2
    taken = step_results([(0, one, flag, False, {}) for one, flag in zip(rewards, flags, strict=True)], "task")
    assert taken.rewards.tolist() == [1.0] * 7 + [2.0**63]
    assert (taken.rewards.dtype, taken.terminated.tolist(), taken.truncated.any()) == (np.float64, [True] * 8, False)
