"""Check the results of `reset` and `step` of users' environments. After every call, as only the first is tried out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, shown

_OF_NUMBERS = "biuf"
"""Kinds of NumPy's types of numbers; flags are among them."""
_FLAG, _FLOAT64 = np.dtype(bool), np.dtype(np.float64)
MOST_ELAPSED = 10**6
"""Most primitive steps of an action."""
_RESET, _STEP = ("observation", "info"), ("observation", "reward", "terminated", "truncated", "info")


class StepResults(NamedTuple):
    """The results of a step in M environments, with one item for each."""

    observations: Sequence[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    infos: Sequence[dict[str, Any]]


def reset_results(results: Sequence[Any], env: str) -> tuple[Sequence[Any], Sequence[dict[str, Any]]]:
    """Return the observations and infos of resets in M environments, called ``env`` in messages."""
    observations, infos = _columns(results, _RESET, env)
    return observations, infos


def step_results(results: Sequence[Any], env: str) -> StepResults:
    """Return what steps in M environments, called ``env`` in messages, returned.

    A reward is a finite number; ``terminated`` and ``truncated`` are True or False, as for Gymnasium's own checker.
    Arrays without axes count as the number or flag that they hold.
    """
    observations, rewards, *ends, infos = _columns(results, _STEP, env)
    flags = _as_array(ends)
    if flags.ndim != 2 or flags.dtype is not _FLAG:
        flags = [_as_flags(values, name, env) for values, name in zip(ends, _STEP[2:], strict=False)]
    terminated, truncated = flags
    return StepResults(observations, _as_numbers(rewards, env), terminated, truncated, infos)


def elapsed_steps(infos: Sequence[Mapping[str, Any]], env: str) -> NDArray[np.int64]:
    """Return ``elapsed`` of the infos of M environments, the primitive steps of an action; 0 where it is missing."""
    elapsed = np.zeros(len(infos), np.int64)
    for place, info in enumerate(infos):
        if "elapsed" in info:
            given = info["elapsed"]
            if isinstance(given, bool) or not isinstance(given, (int, np.integer)) or not 1 <= given <= MOST_ELAPSED:
                rule = f"a whole number from 1 to {MOST_ELAPSED:,}"
                raise InputError(f"info['elapsed'] of {env}, the steps of an action, is {rule}, not {shown(given)}")
            elapsed[place] = given
    return elapsed


def _columns(results: Sequence[Any], names: tuple[str, ...], env: str) -> Sequence[Any]:
    try:
        columns = [*zip(*results, strict=True)]
    except (TypeError, ValueError):  # no iterables, or of several lengths
        columns = []
    if len(columns) != len(names) or {*map(type, results)} != {tuple} or {*map(type, columns[-1])} != {dict}:
        call = f"{'reset' if names is _RESET else 'step'} of {env}"
        for result in results:
            given = f"{len(result)} values" if isinstance(result, tuple) else shown(result)
            if not isinstance(result, tuple) or len(result) != len(names):
                raise InputError(f"{call} must return a tuple ({', '.join(names)}), not {given}")
            if not isinstance(result[-1], dict):
                raise InputError(f"{call} must return a dict as info, not {shown(result[-1])}")
    return columns


def _as_numbers(values: Sequence[Any], env: str) -> NDArray[np.float64]:
    numbers = _as_array(values)
    if numbers.ndim != 1 or numbers.dtype.kind not in _OF_NUMBERS:
        numbers = np.array([*map(_number, values)])
    if numbers.dtype is not _FLOAT64:
        numbers = numbers.astype(np.float64)
    are_finite = np.isfinite(numbers)
    if np.count_nonzero(are_finite) < len(numbers):
        wrong = values[int(are_finite.argmin())]
        raise InputError(f"step of {env} must return a finite number as reward, not {shown(wrong)}")
    return numbers


def _number(value: Any) -> float:
    array = _as_array(value)
    return float(array) if array.ndim == 0 and array.dtype.kind in _OF_NUMBERS else math.nan


def _as_flags(values: Sequence[Any], name: str, env: str) -> NDArray[np.bool_]:
    ones = [*map(_as_array, values)]
    for value, one in zip(values, ones, strict=True):
        if one.ndim or one.dtype is not _FLAG:
            raise InputError(f"step of {env} must return True or False as {name}, not {shown(value)}")
    return np.array([one.item() for one in ones])


def _as_array(value: Any) -> NDArray[Any]:
    try:
        return np.array(value)
    except Exception:  # NumPy makes no array of it, or a class of the user's fails
        return np.array(None)
