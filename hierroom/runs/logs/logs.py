"""The loggers of a run, TensorBoard and Weights & Biases, chosen by name; one that fails is dropped."""

from __future__ import annotations

import importlib
import io
import math
import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tensorboard.compat.proto.event_pb2 import Event, SessionLog  # pyright: ignore[reportAttributeAccessIssue]
from tensorboard.summary.writer.record_writer import RecordWriter
from torch.utils.tensorboard.summary import hparams, scalar

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.logs.learning_curve import LearningCurve
from hierroom.runs.logs.scalars import Logger, Plain, hyperparameters, result_scalars
from hierroom.support.errors import InputError, in_one_line, shown
from hierroom.support.files import append_whole, read_json, to_json, write_atomically
from hierroom.support.output import warn

_NAME = "events.out.tfevents"


class Events(Logger):
    """Writes a session's events into the run's folder; hides earlier ones after ``begins_after`` steps (-1: all)."""

    label = "TensorBoard"

    def __init__(self, path: Path, begins_after: int) -> None:
        self._path = path
        self._begins_after = begins_after
        self._file: Path | None = None

    def _write(self, *events: Event) -> None:
        if self._file is None:
            events = (*self._begin(), *events)
        assert self._file is not None
        records = io.BytesIO()
        for event in events:
            event.wall_time = time.time()
            RecordWriter(records).write(event.SerializeToString())
        append_whole(self._file, records.getvalue())

    def _begin(self) -> list[Event]:
        started = [int(n) for path in self._path.glob(f"{_NAME}.*") if (n := path.name.split(".")[3]).isdecimal()]
        number = max([int(time.time()), *(before + 1 for before in started)])
        self._file = self._path / f"{_NAME}.{number:010d}.{socket.gethostname()}.{os.getpid()}.0"
        begin = Event(file_version="brain.Event:2")
        if not started:
            return [begin]
        return [begin, Event(step=self._begins_after + 1, session_log=SessionLog(status=SessionLog.START))]

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers."""
        self._write(*(Event(step=steps, summary=scalar(name, value)) for name, value in scalars.items()))

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show hyperparameters and results in TensorBoard's table of runs."""
        self._write(*(Event(step=steps, summary=summary) for summary in hparams(hyperparameters, results)))
        self.add({name: value for name, value in results.items() if "steps_to" in name}, steps)


_FILE = "logs.json"
"""The file with the run's id, by which a later session continues the same run."""


class WandbLog(Logger):
    """Shows a run in Weights & Biases over the steps trained; with ``WANDB_MODE=offline`` it uses no network."""

    label = "Weights & Biases"

    def __init__(self, path: Path, hyperparameters: Mapping[str, Plain]) -> None:
        library = wandb_package()
        self._run = library.init(
            project=os.environ.get("WANDB_PROJECT", "hierroom"),
            name=path.resolve().name,
            id=_identity(path),
            resume="allow",
            config=dict(hyperparameters),
            dir=str(path),
            settings=library.Settings(console="off"),  # W&B must not capture printed lines
        )
        self._run.define_metric("steps")
        self._run.define_metric("*", step_metric="steps")
        write_atomically(path / _FILE, to_json({"wandb": self._run.id}))

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers."""
        self._run.log({**{name: value for name, value in scalars.items() if math.isfinite(value)}, "steps": steps})

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show results in the summary of the run."""
        self._run.summary.update({**results, "steps": steps})

    def close(self, *, is_done: bool) -> None:
        """End a session."""
        self._run.finish(exit_code=0 if is_done else 130)  # 130: stopped, may be resumed


def wandb_package() -> Any:
    """Import the package wandb."""
    try:
        library = importlib.import_module("wandb")
    except ImportError:
        library = None
    if getattr(library, "__file__", None) is None:  # a folder of that name, in which it keeps its files
        raise InputError("--log wandb needs the package wandb, which `pip install wandb` installs")
    return library


def _identity(path: Path) -> str | None:
    try:
        identity = read_json(path / _FILE)["wandb"]
    except (InputError, TypeError, KeyError):
        return None
    return identity if isinstance(identity, str) else None


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

    def close(self, *, is_done: bool) -> None:
        """End the session."""
        self._each(lambda logger: logger.close(is_done=is_done))


def _warn(error: Exception, label: str) -> None:
    warn(f"{in_one_line(error)}; training goes on without {label}")
