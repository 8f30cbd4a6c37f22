"""Gymnasium's toy text, made longer: Taxi with several passengers, FrozenLake with keys, CliffWalking with checkpoints.

Observations also say how many places were visited in order, or passengers are home.
"""

import functools
from itertools import pairwise

import gymnasium
from gymnasium.spaces import Dict, Discrete

import hierroom


class InOrder(gymnasium.Wrapper):
    """Counts the cells of a grid that were visited in order; the last one ends the episode, as holes of FrozenLake do.

    Args:
        env: FrozenLake or CliffWalking.
        cells: their numbers, row * columns + column.
    """

    def __init__(self, env, cells):
        super().__init__(env)
        self.cells, self.n = cells, 0
        self.observation_space = Dict(place=env.observation_space, done=Discrete(len(cells) + 1))

    def reset(self, **settings):
        """Begin an episode, with no cell visited."""
        place, info = self.env.reset(**settings)
        self.n = 0
        return {"place": place, "done": self.n}, info

    def step(self, action):
        """Move; count the next cell."""
        place, _, terminated, truncated, info = self.env.step(action)
        self.n += int(place == self.cells[self.n])
        is_home = self.n == len(self.cells)
        terminated = is_home or (terminated and place not in self.cells)
        return {"place": place, "done": self.n}, float(is_home), terminated, truncated, info


class Fares(gymnasium.Wrapper):
    """Taxi with several passengers, one after the other: when one is home, the next one waits at a random corner."""

    def __init__(self, env, passengers):
        super().__init__(env)
        self.passengers, self.homes = passengers, 0
        self.observation_space = Dict(place=env.observation_space, done=Discrete(passengers + 1))

    def reset(self, **settings):
        """Begin an episode."""
        state, info = self.env.reset(**settings)
        self.homes = 0
        return {"place": state, "done": self.homes}, info

    def step(self, action):
        """Drive; Taxi itself ends where a passenger is home."""
        taxi = self.unwrapped
        state, _, terminated, truncated, info = self.env.step(action)
        self.homes += int(terminated)
        is_home = self.homes == self.passengers
        if terminated and not is_home:
            row, col, _, _ = taxi.decode(state)
            start, end = self.np_random.choice(4, 2, replace=False)
            state = taxi.s = taxi.encode(row, col, int(start), int(end))
        return {"place": int(state), "done": self.homes}, float(is_home), is_home, truncated, info


def visits(make, cells, max_steps):
    """Return the task to visit cells in order."""
    goals = {f"cell {n}": lambda env, info, n=n: env.n >= n for n in range(1, len(cells) + 1)}
    rules = {"cell 1": {}} | {name: {"needs": before} for before, name in pairwise(goals)}
    return hierroom.Task(lambda: InOrder(make(), cells), goals, rules, f"cell {len(cells)}", max_steps)


def taxi(passengers, max_steps, *, rain=False):
    """Return the task to bring passengers home."""
    goals = {}
    for n in range(1, passengers + 1):
        goals[f"ride {n}"] = lambda env, info, n=n: env.homes + (env.unwrapped.s // 4 % 5 == 4) >= n
        goals[f"home {n}"] = lambda env, info, n=n: env.homes >= n
    rules = {"ride 1": {}} | {name: {"needs": before} for before, name in pairwise(goals)}
    own = {"is_rainy": rain, "max_episode_steps": max_steps}
    make = functools.partial(gymnasium.make, "Taxi-v4", **own)
    last = f"home {passengers}"
    return hierroom.Task(lambda: Fares(make(), passengers), goals, rules, last, max_steps, action_mask="")


def lake(desc, slips, max_steps):
    """Return FrozenLake on a map: K are its keys, from left to right and from top to bottom, and E the end."""
    text = "".join(desc)
    cells = [n for n, letter in enumerate(text) if letter == "K"] + [text.index("E")]
    plain = [row.replace("K", "F").replace("E", "F") for row in desc]
    own = {"desc": plain, "is_slippery": slips, "max_episode_steps": max_steps}
    return visits(functools.partial(gymnasium.make, "FrozenLake-v1", **own), cells, max_steps)


def cliff(cells, max_steps, *, slips=False):
    """Return CliffWalking with checkpoints; to step off the cliff leads back to the start."""
    own = {"is_slippery": slips, "max_episode_steps": max_steps}
    return visits(functools.partial(gymnasium.make, "CliffWalking-v1", **own), cells, max_steps)


_SMALL = ["SFFF", "FKFF", "FFHF", "HFFE"]
_LARGE = ["SFFFFF", "FFKFFF", "FFFFHF", "FFFFFF", "FHKFFF", "FFFFFE"]
TASKS = {
    "taxi_1": taxi(1, 200),
    "taxi_2": taxi(2, 800),
    "taxi_2_short": taxi(2, 250),
    "taxi_1_rain": taxi(1, 300, rain=True),
    "lake_small": lake(_SMALL, False, 200),
    "lake_large": lake(_LARGE, False, 300),
    "lake_small_slips": lake(_SMALL, True, 300),
    "cliff_2": cliff([12, 7], 300),
    "cliff_3": cliff([0, 8, 1], 1000),
    "cliff_2_slips": cliff([0, 7], 500, slips=True),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.toy_text:taxi_1
