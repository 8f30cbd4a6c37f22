"""The values of a task's goals in environments, from the user's functions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, raise_in_one_line, shown

GoalFunction = Callable[[Any, dict[str, Any]], Any]
"""A function of the environment and the info of its last step; it returns whether or how often a goal was achieved."""
_TRUTHS = {bool, np.bool_}
_MOST = 2**62


def goal_values(
    goals: Mapping[str, GoalFunction], envs: Iterable[Any], infos: Iterable[dict[str, Any]], task: str
) -> list[Any]:
    """Call every goal's function in each of M environments, and return the M * G results unchanged.

    Args:
        envs: the environments, as they were made.
        infos: the info of the last step or reset of each.
        task: the name of the task, for errors.
    """
    functions, values = (*goals.values(),), []
    keep = values.append
    try:
        for env, info in zip(envs, infos, strict=True):
            for function in functions:
                keep(function(env, info))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # user code may raise anything
        raise_in_one_line(f"goal {[*goals][len(values) % len(functions)]!r} of {task}", error)
    return values


def as_totals(values: list[Any], n_envs: int, goals: Mapping[str, GoalFunction], task: str) -> NDArray:
    """Return the results of `goal_values` in M environments as an array [M, G] of bools or counts."""
    kinds = {*map(type, values)}
    if not kinds <= _TRUTHS:
        for number, value in enumerate(values):
            is_whole = isinstance(value, (bool, int, np.bool_, np.integer))
            if not is_whole or not 0 <= value < _MOST:
                name, rule = [*goals][number % len(goals)], "must return True, False or a count of at least 0"
                raise InputError(f"goal {name!r} of {task} {rule}, not {shown(value)}")
    dtype = np.bool_ if kinds <= _TRUTHS else np.int64
    return np.array(values, dtype).reshape(n_envs, len(goals))
