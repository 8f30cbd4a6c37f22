"""A challenge to the predictions: a robot in RWARE's warehouse (rware 2.0) takes shelves to the counter and back.

Nobody used this world for the model. The robot turns, drives, and lifts or puts down the shelf that it is under; with
a shelf it cannot drive under others. It sees 3 x 3 cells, which of them are shelves that were ordered, and where it is.
Which shelves are ordered, and where the robot starts, is random in each episode. Three tasks, chosen to be hard to
predict: an easy one with a generous limit, one with hardly more time than it takes, and a chain of five goals.

    pip install rware==2.0.0
    python -m hierroom advise --task benchmarks.arena.challenge:hurried
    python -m hierroom train --task benchmarks.arena.challenge:hurried --steps 200_000 --evaluation-steps 100_000
"""

from itertools import pairwise

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete
from rware.warehouse import ObservationType, RewardType, Warehouse

import hierroom

SMALL = """
......
.xx.x.
.xx.x.
......
..gg..
"""


class Courier(gymnasium.Wrapper):
    """One robot alone; counts what it did in order: lifts an ordered shelf, delivers it, puts it back, and so on.

    Args:
        orders: shelves that are ordered at a time.
        jobs: lifts, deliveries and returns until the episode ends.
    """

    def __init__(self, orders, jobs):
        settings = {"layout": SMALL, "observation_type": ObservationType.FLATTENED, "reward_type": RewardType.TWO_STAGE}
        # rows and columns are not used with a layout; 1 robot, 0 bits of messages, 1 cell seen around, no limits
        super().__init__(Warehouse(1, 1, 1, 1, 0, 1, orders, None, None, **settings))
        self.jobs, self.done = jobs, 0
        seen = self.env.observation_space[0]
        self.action_space = self.env.action_space[0]
        self.observation_space = Dict(seen=Box(-np.inf, np.inf, seen.shape, seen.dtype), done=Discrete(jobs + 1))

    def reset(self, **settings):
        """Begin an episode, with nothing done."""
        seen, info = self.env.reset(**settings)
        self.done = 0
        return {"seen": seen[0], "done": 0}, info

    def step(self, action):
        """Act; count the next job."""
        seen, _, terminated, truncated, info = self.env.step((int(action),))
        robot, orders = self.env.agents[0], self.env.request_queue
        shelf = robot.carrying_shelf
        now = (shelf is not None and shelf in orders, robot.has_delivered, shelf is None)
        self.done += int(now[self.done % 3])
        is_end = self.done == self.jobs
        return {"seen": seen[0], "done": self.done}, float(is_end), terminated or is_end, truncated, info


def courier(orders, jobs, max_steps):
    """Return the task to do some jobs in order."""
    names = [f"{what} {n}" for n in range(1, jobs + 1) for what in ("lift", "deliver", "return")][:jobs]
    goals = {name: lambda env, info, n=n: env.done >= n for n, name in enumerate(names, 1)}
    rules = {names[0]: {}} | {name: {"needs": before} for before, name in pairwise(names)}
    return hierroom.Task(lambda: Courier(orders, jobs), goals, rules, names[-1], max_steps)


TASKS = {
    "generous": courier(3, 2, 2000),
    "hurried": courier(1, 2, 60),
    "two_orders": courier(3, 5, 1000),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.challenge:hurried
