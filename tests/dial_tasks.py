"""Tasks with actions that are arrays: the nearer each number is to its largest, the higher the reward."""

import gymnasium
import numpy as np
from gymnasium import spaces

import hierroom


class Dials(gymnasium.Env):
    """Shows a random number; refuses actions outside its space. An episode has ten steps."""

    def __init__(self, actions):
        self.action_space, self.observation_space = actions, spaces.Box(0, 1, (1,), np.float32)
        if isinstance(actions, spaces.MultiBinary):
            self.low, self.high = np.zeros(actions.shape), np.ones(actions.shape)
        elif isinstance(actions, spaces.Box):
            self.low, self.high = actions.low.astype(float), actions.high.astype(float)
        else:
            self.low, self.high = actions.start, actions.start + actions.nvec - 1

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.n, self.reward = 0, 0.0
        return self.np_random.random(1, np.float32), {}

    def step(self, action):
        assert isinstance(action, np.ndarray)
        assert self.action_space.contains(action)
        self.n, self.taken = self.n + 1, action
        self.reward = float(np.mean((action - self.low) / (self.high - self.low)))
        return self.np_random.random(1, np.float32), self.reward, False, self.n == 10, {}

    def render(self):
        return np.full((8, 8), int(255 * self.reward), np.uint8)


SPACES = {
    "box": spaces.Box(np.float32([-2, 0]), np.float32([2, 0.5])),
    "double": spaces.Box(-1, 3, (), np.float64),
    "whole": spaces.Box(-3, 3, (2, 2), np.int8),
    "bytes": spaces.Box(0, 255, (2,), np.uint8),
    "multi": spaces.MultiDiscrete([3, 2, 4], start=[1, 0, -1]),
    "binary": spaces.MultiBinary((2, 2)),
}


def dials(space):
    """Return the task of an action space, whose goal is a reward above one half."""
    goals = {"half": lambda env, info: env.unwrapped.reward > 0.5}
    return hierroom.Task(lambda: Dials(space), goals, target="half", label="dials")


box, multi, binary = (hierroom.Task(lambda name=name: Dials(SPACES[name])) for name in ("box", "multi", "binary"))
