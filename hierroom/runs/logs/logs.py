"""The loggers of a run, chosen by name; they continue earlier sessions, and one that fails is dropped."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.logs.events import Events
from hierroom.runs.logs.learning_curve import LearningCurve
from hierroom.runs.logs.libraries import LIBRARIES, load_library
from hierroom.runs.logs.scalars import Logger, hyperparameters, result_scalars
from hierroom.support.errors import InputError, in_one_line, shown
from hierroom.support.files import to_json, write_atomically
from hierroom.support.output import warn
from hierroom.support.reading import read_json

TENSORBOARD, NONE = "tensorboard", "none"
DEFAULT = (TENSORBOARD,)
_FILE = "logs.json"
"""The file with the run's identity in each logger outside the run's folder."""


def logger_names(text: str) -> tuple[str, ...]:
    """Return the names of loggers in a text such as ``tensorboard,wandb``; no names for ``none``."""
    if not isinstance(text, str):
        raise InputError(f"log is a text of names joined by commas, or {NONE!r}, not {shown(text)}")
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    if names == (NONE,):
        return ()
    known = (TENSORBOARD, *LIBRARIES)
    if not {*names} <= {*known}:
        raise InputError(f"--log takes {', '.join(known)}, joined by commas, or {NONE}, not {text!r}")
    for name in names:
        if name in LIBRARIES:
            load_library(name)
    return names


class Logs:
    """The loggers of a session. If one fails, the user is warned once, and training goes on without it.

    ``begins_after`` is the number of steps before this session, -1 in the first. ``names`` come from the user, not from
    the folder, which is untrusted.
    """

    def __init__(self, path: Path, config: TrainConfig, begins_after: int, names: Sequence[str] = DEFAULT) -> None:
        self._config = config
        self._loggers: list[Logger] = [Events(path, begins_after)] if TENSORBOARD in names else []
        identities = _identities(path)
        for name in filter(LIBRARIES.__contains__, names):
            try:
                logger = LIBRARIES[name](load_library(name), path, hyperparameters(config), identities.get(name))
            except Exception as error:  # a library may raise anything
                _warn(error, LIBRARIES[name].label)
                continue
            self._loggers.append(logger)
            identities[name] = logger.identity
            write_atomically(path / _FILE, to_json(identities))

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


def _identities(path: Path) -> dict[str, str]:
    try:
        known = read_json(path / _FILE)
        return {name: known[name] for name in LIBRARIES if isinstance(known.get(name), str)}
    except (InputError, AttributeError):
        return {}
