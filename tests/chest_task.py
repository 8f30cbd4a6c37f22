"""A toy environment of Gymnasium and tasks of it: a corridor with coins, a key and a chest."""

import gymnasium
import numpy as np
from gymnasium import spaces

import hierroom

LEFT, RIGHT, USE = range(3)
COIN, KEY, CHEST = 1, 3, 4


class Chest(gymnasium.Env):
    """Cells 0 to 4: a coin can be taken in cell 1 again and again, the key once in 3; the chest in 4 needs the key.

    The start is cell 0 or 2, as the seed says. USE has no effect where there is nothing to use. Cell -1 is a pit.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012
    action_space = spaces.Discrete(3, start=10)
    observation_space = spaces.Dict(
        {
            "place": spaces.Discrete(6, start=-1),
            "held": spaces.Dict({"key": spaces.MultiBinary(1), "coins": spaces.Box(0, np.inf, (1,), np.float64)}),
            "picture": spaces.Box(0, 255, (5, 7, 3), np.uint8),
            "goal": spaces.Discrete(1000),
            "hint": spaces.Text(20),
        }
    )

    def __init__(self, render_mode=None, is_random=False):
        self.render_mode, self.is_random = render_mode, is_random

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.cell = 2 * int(np.random.randint(2) if self.is_random else self.np_random.integers(2))  # noqa: NPY002
        self.has_key, self.coins, self.is_open, self.noise = False, 0, False, int(self.np_random.integers(1000))
        return self._observation(), {}

    def step(self, action):
        action -= 10
        if action == USE:
            self.coins += self.cell == COIN
            self.has_key |= self.cell == KEY
            self.is_open |= self.cell == CHEST and self.has_key
        else:
            self.cell = min(self.cell + (1 if action == RIGHT else -1), CHEST)
        return self._observation(), float(self.is_open), self.cell < 0, False, {"cell": self.cell}

    def _observation(self):
        picture = np.zeros((5, 7, 3), np.uint8)
        picture[2, self.cell + 1] = 1, 2, 3
        held = {"key": np.array([self.has_key], np.int8), "coins": np.array([self.coins], np.float64)}
        return {"place": self.cell, "held": held, "picture": picture, "goal": self.noise, "hint": "chest"}

    def render(self):
        return np.full((40, 60, 3), 40 * (self.cell + 1), np.uint8) if self.render_mode == "rgb_array" else None


def has_coins(env, info):
    return env.unwrapped.coins


def has_key(env, info):
    return env.unwrapped.has_key


def is_open(env, info):
    return env.unwrapped.is_open


GOALS = {"coin": has_coins, "key": has_key, "chest": is_open}
RULES = {"coin": {}, "key": {}, "chest": {"needs": "key"}}
chest = hierroom.Task(make=Chest, goals=GOALS, rules=RULES, target="chest", max_steps=30, capacity={"coin": 2})
camp = hierroom.Task(make=Chest, goals=GOALS, rules=RULES, max_steps=30, capacity={"coin": 2}, label="camp")
free = hierroom.Task(make=Chest, goals=GOALS, target="chest", max_steps=30)
split = hierroom.Task(make=Chest, goals=GOALS, rules=RULES, target="chest", max_steps=30, processes=2)
dice = hierroom.Task(make=lambda: Chest(is_random=True), goals=GOALS, target="chest", max_steps=30)
lake = hierroom.Task(
    make=lambda: gymnasium.make("FrozenLake-v1", is_slippery=False),
    goals={"half": lambda env, info: env.unwrapped.s == 8, "gift": lambda env, info: env.unwrapped.s == 15},
    target="gift",
    max_steps=50,
    label="frozen lake",
)
taxi = hierroom.Task(
    make="Taxi-v4",
    goals={
        "passenger": lambda env, info: env.unwrapped.s // 4 % 5 == 4,
        "home": lambda env, info: env.unwrapped.s // 4 % 5 == env.unwrapped.s % 4,
    },
    rules={"passenger": {}, "home": {"needs": "passenger"}},
    target="home",
    max_steps=200,
)
pole = hierroom.Task(
    make="CartPole-v1",
    goals={
        "right": lambda env, info: env.unwrapped.state[0] > 0.1,
        "left": lambda env, info: env.unwrapped.state[0] < -0.1,
    },
    target="left",
    vectors={"right": [1.0], "left": [-1.0]},
)


def hurry(step):
    """A user's reward, which in a task sees no states."""
    assert step.before is step.after is None
    return step.success - 0.01


balance = hierroom.Task(make="CartPole-v1", max_steps=60)
two_balances = hierroom.Task(make="CartPole-v1", goals=None, max_steps=60, processes=2)
