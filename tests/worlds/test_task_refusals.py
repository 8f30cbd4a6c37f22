"""Errors in a user's task, or in its use, raise one-line errors."""

import math
import re

import gymnasium
import numpy as np
import pytest
from chest_task import GOALS, Chest, chest

import hierroom
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
