"""The state of a task's goals in an environment, as the user's functions return it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hierroom.support.errors import InputError, raise_told, shown

GoalFunction = Callable[[Any, dict[str, Any]], Any]
"""From the environment and the info of its last step to whether a goal is achieved, or how often it has been."""


def goal_values(goals: Mapping[str, GoalFunction], env: Any, info: dict[str, Any], task: str) -> list[int]:
    """Return for each goal its count, or whether it is there.

    Args:
        env: the environment, as it was made.
        info: of its last step or reset.
        task: the name of the task, for errors.
    """
    values = []
    for name, function in goals.items():
        try:
            value = function(env, info)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever a user's own code may raise
            raise_told(f"goal {name!r} of {task}", error)
        if value is not True and value is not False:
            value = _whole(value, name, task)
        values.append(value)
    return values


def _whole(value: Any, name: str, task: str) -> bool | int:
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, (int, np.integer)) and 0 <= value < 2**62:
        return int(value)
    rule = "must return True, False or a count of at least 0"
    raise InputError(f"goal {name!r} of {task} {rule}, not {shown(value)}")
