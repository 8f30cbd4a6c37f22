"""The loggers of a run, chosen by name; one that fails is dropped."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.logs.events import Events
from hierroom.runs.logs.learning_curve import LearningCurve
from hierroom.runs.logs.scalars import Logger, hyperparameters, result_scalars
from hierroom.runs.logs.wandb_log import WandbLog, wandb_package
from hierroom.support.errors import InputError, in_one_line, shown
from hierroom.support.output import warn

TENSORBOARD, WANDB, NONE = "tensorboard", "wandb", "none"
DEFAULT = (TENSORBOARD,)


def logger_names(text: str) -> tuple[str, ...]:
    """Return the names of loggers in a text such as ``tensorboard,wandb``; no names for ``none``."""
    if not isinstance(text, str):
        raise InputError(f"log is a text of names joined by commas, or {NONE!r}, not {shown(text)}")
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    if names == (NONE,):
        return ()
    if not {*names} <= {TENSORBOARD, WANDB}:
        raise InputError(f"--log takes {TENSORBOARD}, {WANDB}, joined by commas, or {NONE}, not {text!r}")
    if WANDB in names:
        wandb_package()
    return names


class Logs:
    """The loggers of a session. If one fails, the user is warned once, and training goes on without it.

    ``begins_after`` is the number of steps before this session, -1 in the first. ``names`` come from the user, not from
    the folder, which is untrusted.
    """

    def __init__(self, path: Path, config: TrainConfig, begins_after: int, names: Sequence[str] = DEFAULT) -> None:
        self._config = config
        self._loggers: list[Logger] = [Events(path, begins_after)] if TENSORBOARD in names else []
        if WANDB in names:
            try:
                self._loggers.append(WandbLog(path, hyperparameters(config)))
            except Exception as error:  # a library may raise anything
                _warn(error, WandbLog.label)

    def _each(self, act: Callable[[Logger], object]) -> None:
        for logger in [*self._loggers]:
            try:
                act(logger)
            except Exception as error:
                self._loggers.remove(logger)
                _warn(error, logger.label)

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers, see `scalars.Logger`; NaNs, for quantities without a value yet, are left out."""
        known = {tag: value for tag, value in scalars.items() if not math.isnan(value)}
        self._each(lambda logger: logger.add(known, steps))

    def add_results(self, curve: LearningCurve | None) -> None:
        """Show hyperparameters and results."""
        results = hyperparameters(self._config), result_scalars(curve), self._config.steps
        self._each(lambda logger: logger.add_results(*results))

    def sync(self) -> None:
        """Make the numbers so far survive a loss of power."""
        self._each(lambda logger: logger.sync())

    def close(self, *, is_done: bool) -> None:
        """End the session."""
        self._each(lambda logger: logger.close(is_done=is_done))


def _warn(error: Exception, label: str) -> None:
    warn(f"{in_one_line(error)}; training goes on without {label}")
