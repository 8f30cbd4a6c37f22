"""A trial of a task: a few random steps in one environment."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from hierroom.support.env_results import reset_results
from hierroom.support.errors import InputError, user_code, warn_once
from hierroom.worlds.actions import Actions, actions_of
from hierroom.worlds.task.goal_values import as_totals, goal_values
from hierroom.worlds.task.local_envs import LocalEnvs
from hierroom.worlds.task.masks import MaskPlace, all_forbidden, find_mask, refuse_late_mask
from hierroom.worlds.task.parts import TaskParts, Trial
from hierroom.worlds.task.spaces import MAX_CATEGORIES, are_symbols, flat_entries, is_byte_image, n_symbols, read_entry
from hierroom.worlds.task.vector_envs import VectorEnvs

N_STEPS, N_VECTOR = 20, 2


def try_out(task: TaskParts) -> Trial:
    """Take random steps in a new environment of a task, and raise its errors as one line."""
    if task.make_vec is not None:
        return _try_out_vector(task)
    env, envs = task.new_env(), LocalEnvs(task, 1)
    if envs.envs[0].unwrapped is env.unwrapped:
        raise InputError(f"make of {task.name} must return a new environment each time, not always the same one")
    with user_code(f"make of {task.name}"):
        action_space, space = env.action_space, env.observation_space
    actions = actions_of(action_space, task.name, MAX_CATEGORIES - 1)
    entries, left_out = flat_entries(space)
    with user_code(f"reset of {task.name}"):
        first, infos = reset_results([env.reset(seed=0)], task.name)
        mask = envs.mask = find_mask(task.action_mask, actions.n, env, first[0], infos[0], task.name)
    entries = entries if mask is None else mask.left_out_of(entries)
    values = goal_values(task.goals, [env], infos, task.name)
    as_totals(values, 1, task.goals, task.name)  # refuses wrong ones
    are_counts = tuple(not isinstance(value, (bool, np.bool_)) for value in values)
    _warn_of_target(task, values, are_counts)
    with user_code(f"close of {task.name}"):
        env.close()
    random, seconds = np.random.default_rng(0), []
    seen: dict[str, set[int]] = {name: set() for name, (_, space) in entries.items() if is_byte_image(space)}

    def look(observations: Sequence[Any]) -> Any:
        mask = None
        if envs.mask is not None:
            observations, (mask,) = zip(*observations, strict=True)
        for name, values in seen.items():
            values.update(np.unique(read_entry(observations, name, *entries[name], task.name)).tolist())
        return mask

    now = look(envs.reset([0], [0])[0])
    for _ in range(N_STEPS):
        if now is not None and not now.any():
            raise InputError(all_forbidden(task.name))
        drawn = actions.sample(random, 1) if now is None else random.choice(np.flatnonzero(now), 1)
        action, started = actions.for_envs(drawn), time.perf_counter()
        taken = envs.step([0], action)
        seconds.append(time.perf_counter() - started)
        now = look(taken.observations)
        if mask is None:
            refuse_late_mask(task.action_mask, actions.n, envs.infos[0], task.name)
        is_at_target = task.goal_set.has_target and taken.totals[0, task.goal_set.target]
        if taken.terminated[0] or taken.truncated[0] or is_at_target:
            now = look(envs.reset([0], [0])[0])
    envs.close()
    return _trial(task, env, actions, entries, left_out, are_counts, mask, seen, seconds)


def _try_out_vector(task: TaskParts) -> Trial:
    vector, random, seconds = VectorEnvs(task, N_VECTOR), np.random.default_rng(0), []
    actions = actions_of(vector.env.single_action_space, task.name, MAX_CATEGORIES - 1)
    _, left_out = flat_entries(vector.env.single_observation_space)
    now = vector.reset(0)
    _warn_of_target(task, now.totals.max(axis=0), vector.are_counts)
    seen: dict[str, set[int]] = {name: set() for name, (_, space) in vector.entries.items() if is_byte_image(space)}
    for _ in range(N_STEPS):
        for name, values in seen.items():
            values.update(np.unique(now.entries[name]).tolist())
        drawn = actions.sample(random, N_VECTOR)
        if now.masks is not None:
            drawn = (now.masks * (1 + random.random(now.masks.shape))).argmax(axis=1)
        started = time.perf_counter()
        taken = vector.step(np.array(actions.for_envs(drawn)))
        seconds.append((time.perf_counter() - started) / N_VECTOR)
        if vector.mask is None:
            refuse_late_mask(task.action_mask, actions.n, vector.infos or {}, task.name)
        has_ended = taken.terminated | taken.truncated
        now = vector.reset(0) if vector.mode is AutoresetMode.DISABLED and has_ended.any() else taken.now
    if error := vector.close():
        raise error
    found = vector.entries, left_out, vector.are_counts, vector.mask
    return _trial(task, vector.env, actions, *found, seen, seconds)


def _warn_of_target(task: TaskParts, values: Sequence[Any], are_counts: Sequence[bool]) -> None:
    goals = task.goal_set
    if goals.has_target and values[goals.target] and not are_counts[goals.target]:
        name = goals.names[goals.target]
        warn_once(f"the target {name!r} of {task.name} is true at a reset; such an episode cannot achieve it")


def _trial(
    task: TaskParts,
    env: Any,
    actions: Actions,
    entries: Mapping[str, Any],
    left_out: Sequence[str],
    are_counts: tuple[bool, ...],
    mask: MaskPlace | None,
    seen: Mapping[str, set[int]],
    seconds: list[float],
) -> Trial:
    """Return the facts; ``seen`` has the values of each entry that is an image of bytes."""
    symbols = [name for name, values in seen.items() if are_symbols(entries[name][1], values)]
    if task.symbols is not None:
        if wrong := [name for name in task.symbols if name not in seen]:
            images = f"these are {', '.join(seen)}" if seen else "it has none"
            raise InputError(f"symbols of {task.name} are entries that are images of bytes, not {wrong[0]!r}; {images}")
        symbols = task.symbols
    of_symbols = {name: n_symbols(seen[name]) for name in symbols}
    limit = getattr(getattr(env, "spec", None), "max_episode_steps", None)
    limit = limit if isinstance(limit, int) and limit > 0 else None
    return Trial(entries, left_out, actions, are_counts, of_symbols, float(np.median(seconds)), mask, limit)
