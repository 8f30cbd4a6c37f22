"""A trial of a task: a few random steps in one environment."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from hierroom.support.env_results import reset_results
from hierroom.support.errors import InputError, user_code, warn_once
from hierroom.worlds.actions import actions_of
from hierroom.worlds.task.goal_values import goal_values
from hierroom.worlds.task.local_envs import LocalEnvs
from hierroom.worlds.task.parts import TaskParts, Trial
from hierroom.worlds.task.spaces import MAX_CATEGORIES, are_symbols, flat_entries, is_byte_image, n_symbols, read_entry

N_STEPS, N_PICTURES = 20, 3


def try_out(task: TaskParts) -> Trial:
    """Take random steps in a new environment of a task, and raise its errors as one line."""
    env, envs = task.new_env(), LocalEnvs(task, 1)
    if envs.envs[0].unwrapped is env.unwrapped:
        raise InputError(f"make of {task.name} must return a new environment each time, not always the same one")
    with user_code(f"make of {task.name}"):
        action_space, space = env.action_space, env.observation_space
    actions = actions_of(action_space, task.name, MAX_CATEGORIES - 1)
    entries, left_out = flat_entries(space)
    with user_code(f"reset of {task.name}"):
        _, infos = reset_results([env.reset(seed=0)], task.name)
    values = goal_values(task.goals, [env], infos, task.name)
    are_counts = tuple(not isinstance(value, (bool, np.bool_)) for value in values)
    goals = task.goal_set
    if goals.has_target and values[goals.target] and not are_counts[goals.target]:
        name = goals.names[goals.target]
        warn_once(f"the target {name!r} of {task.name} is true at a reset; such an episode cannot achieve it")
    with user_code(f"close of {task.name}"):
        env.close()
    random, seconds = np.random.default_rng(0), []
    seen: dict[str, set[int]] = {name: set() for name, (_, space) in entries.items() if is_byte_image(space)}

    def look(observations: Sequence[Any]) -> None:
        for name, values in seen.items():
            values.update(np.unique(read_entry(observations, name, *entries[name], task.name)).tolist())

    look(envs.reset([0], [0])[0])
    for _ in range(N_STEPS):
        action, started = actions.for_envs(actions.sample(random, 1)), time.perf_counter()
        taken = envs.step([0], action)
        seconds.append(time.perf_counter() - started)
        look(taken.observations)
        if taken.terminated[0] or taken.truncated[0]:
            look(envs.reset([0], [0])[0])
    envs.close()
    symbols = [name for name, values in seen.items() if are_symbols(entries[name][1], values)]
    if task.symbols is not None:
        if wrong := [name for name in task.symbols if name not in seen]:
            images = f"these are {', '.join(seen)}" if seen else "it has none"
            raise InputError(f"symbols of {task.name} are entries that are images of bytes, not {wrong[0]!r}; {images}")
        symbols = task.symbols
    of_symbols = {name: n_symbols(seen[name]) for name in symbols}
    return Trial(entries, left_out, actions, are_counts, of_symbols, float(np.median(seconds)))


def picture_seconds(task: TaskParts) -> float:
    """Return the shortest time in which a new environment of a task draws a picture; it may be unable to."""
    envs, seconds = LocalEnvs(task, 1, "rgb_array"), []
    envs.reset([0], [0])
    for _ in range(N_PICTURES):  # the first one may import and compile
        started = time.perf_counter()
        envs.render(0)
        seconds.append(time.perf_counter() - started)
    envs.close()
    return min(seconds)
