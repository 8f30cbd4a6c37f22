"""Check the results of `reset` and `step` of users' environments. After every call, as only the first is tried out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, shown

_OF_NUMBERS = "biuf"
"""Kinds of NumPy's types of numbers; flags are among them."""


class StepResults(NamedTuple):
    """The results of a step in M environments, with one item for each."""

    observations: Sequence[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    infos: Sequence[dict[str, Any]]


def reset_results(results: Sequence[Any], env: str) -> tuple[Sequence[Any], Sequence[dict[str, Any]]]:
    """Return the observations and infos of resets in M environments, called ``env`` in messages."""
    observations, infos = _columns(results, f"reset of {env}", "observation, info")
    return observations, infos


def step_results(results: Sequence[Any], env: str) -> StepResults:
    """Return what steps in M environments, called ``env`` in messages, returned.

    A reward is a finite number; ``terminated`` and ``truncated`` are True or False, as for Gymnasium's own checker.
    Arrays without axes count as the number or flag that they hold.
    """
    step = f"step of {env}"
    columns = _columns(results, step, "observation, reward, terminated, truncated, info")
    observations, rewards, terminated, truncated, infos = columns
    ends, cuts = _as_flags(terminated, step, "terminated"), _as_flags(truncated, step, "truncated")
    return StepResults(observations, _as_numbers(rewards, step), ends, cuts, infos)


def unpaid_step(result: Any, env: str) -> tuple[Any, bool, bool]:
    """Return observation, ``terminated`` and ``truncated`` of a step in one environment, for play without rewards."""
    if not (type(result) is tuple and len(result) == 5 and type(result[2]) is type(result[3]) is bool):
        (observation,), _, terminated, truncated, _ = step_results([result], env)
        return observation, terminated.item(), truncated.item()
    return result[0], result[2], result[3]


def _columns(results: Sequence[Any], call: str, names: str) -> Sequence[Any]:
    n = len(names.split())
    try:
        columns = [*zip(*results, strict=True)]
    except (TypeError, ValueError):  # no iterables, or of several lengths
        columns = []
    if len(columns) != n or {*map(type, results)} != {tuple} or {*map(type, columns[-1])} != {dict}:
        for result in results:
            given = f"{len(result)} values" if isinstance(result, tuple) else shown(result)
            if not isinstance(result, tuple) or len(result) != n:
                raise InputError(f"{call} must return a tuple ({names}), not {given}")
            if not isinstance(result[-1], dict):
                raise InputError(f"{call} must return a dict as info, not {shown(result[-1])}")
    return columns


def _as_numbers(values: Sequence[Any], call: str) -> NDArray[np.float64]:
    numbers = _as_array(values)
    if numbers.ndim != 1 or numbers.dtype.kind not in _OF_NUMBERS:
        numbers = np.array([*map(_number, values)])
    numbers = numbers.astype(np.float64, copy=False)
    if not (are_finite := np.isfinite(numbers)).all():
        wrong = values[int(np.argmin(are_finite))]
        raise InputError(f"{call} must return a finite number as reward, not {shown(wrong)}")
    return numbers


def _number(value: Any) -> float:
    """Return a number of any type, and NaN for anything else."""
    array = _as_array(value)
    return float(array) if array.ndim == 0 and array.dtype.kind in _OF_NUMBERS else math.nan


def _as_flags(values: Sequence[Any], call: str, name: str) -> NDArray[np.bool_]:
    flags = _as_array(values)
    if flags.ndim != 1 or flags.dtype != bool:
        ones = [*map(_as_array, values)]
        for value, one in zip(values, ones, strict=True):
            if one.ndim or one.dtype != bool:
                raise InputError(f"{call} must return True or False as {name}, not {shown(value)}")
        flags = np.array([one.item() for one in ones])
    return flags


def _as_array(value: Any) -> NDArray[Any]:
    try:
        return np.array(value)
    except Exception:  # NumPy makes no array of it, or a class of the user's fails
        return np.array(None)
