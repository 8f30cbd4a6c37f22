"""N environments of a task in this process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from hierroom.support.errors import own_code
from hierroom.worlds.task.goal_values import goal_values
from hierroom.worlds.task.parts import TaskParts


class Taken(NamedTuple):
    """The results of a step in some environments, an item for each."""

    observations: list[Any]
    rewards: list[Any]
    terminated: list[Any]
    truncated: list[Any]
    totals: list[list[int]]  # how its goals stand


class LocalEnvs:
    """N environments that are stepped one after the other."""

    def __init__(self, task: TaskParts, num_envs: int) -> None:
        self._name, self._goals = task.name, task.goals
        self._envs = [task.new_env() for _ in range(num_envs)]

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[list[Any], list[list[int]]]:
        """Begin an episode in some environments; return what they show, and how their goals stand."""
        observations, totals = [], []
        with own_code(f"reset of {self._name}"):
            for number, seed in zip(envs, seeds, strict=True):
                env = self._envs[number]
                observation, info = env.reset(seed=seed)
                observations.append(observation)
                totals.append(goal_values(self._goals, env, info, self._name))
        return observations, totals

    def step(self, envs: Sequence[int], actions: Sequence[int]) -> Taken:
        """Act in some environments."""
        taken = Taken([], [], [], [], [])
        observations, rewards, terminated = taken.observations.append, taken.rewards.append, taken.terminated.append
        truncated, totals = taken.truncated.append, taken.totals.append
        all_envs, goals, name = self._envs, self._goals, self._name
        with own_code(f"step of {name}"):
            for number, action in zip(envs, actions, strict=True):
                env = all_envs[number]
                observation, reward, ends, is_cut, info = env.step(action)
                observations(observation)
                rewards(reward)
                terminated(ends)
                truncated(is_cut)
                totals(goal_values(goals, env, info, name))
        return taken

    def render(self, env: int) -> Any:
        """Return what an environment draws."""
        with own_code("the environment", "cannot be drawn"):
            return self._envs[env].render()

    def close(self) -> None:
        """Close all environments."""
        for env in self._envs:
            env.close()
