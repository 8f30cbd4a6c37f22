"""What TensorBoard shows of a run, in groups."""

from __future__ import annotations

import io
import os
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from tensorboard.compat.proto.event_pb2 import Event, SessionLog  # pyright: ignore[reportAttributeAccessIssue]
from tensorboard.summary.writer.record_writer import RecordWriter
from torch.utils.tensorboard.summary import hparams, scalar

from hierroom.errors import InputError
from hierroom.files import append_whole, sync
from hierroom.training.config import TrainConfig
from hierroom.training.evaluation import Evaluation, Score
from hierroom.training.learning_curve import MILESTONES, LearningCurve
from hierroom.training.output import warn

_NAME = "events.out.tfevents"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "time": ("seconds", "compile_seconds", "steps_per_second"),
    "train": ("episodes", "success_rate", "episode_length", "episode_return", "stage"),
}
"""The tags of the entries of ``metrics.csv`` begin with these; those of others with the agent that they tell of."""


def tag(name: str) -> str:
    """The tag of an entry of ``metrics.csv``: that of ``meta_entropy`` is ``meta/entropy``."""
    for group, names in GROUPS.items():
        if name in names:
            return f"{group}/{name}"
    return f"meta/{name.removeprefix('meta_')}" if name.startswith("meta_") else f"controller/{name}"


class Events:
    """Writes the TensorBoard events of a run, into one file for each session that trains it.

    The file is there from the first event on. If it cannot be written, a warning says so once, and training goes on
    without it.

    Args:
        path: the run's folder.
        config: the run's config.
        begins_after: steps that were taken before this session; what earlier sessions, which were killed, showed of
            later ones is hidden. -1: all of it.
    """

    def __init__(self, path: Path, config: TrainConfig, begins_after: int) -> None:
        self._path = path
        self._config = config
        self._begins_after = begins_after
        self._file: Path | None = None
        self._has_failed = False

    def _write(self, *events: Event) -> None:
        """Append events to the file; an event is there as soon as this returns."""
        if self._has_failed:
            return
        try:
            if self._file is None:
                events = (*self._begin(), *events)
            assert self._file is not None
            records = io.BytesIO()
            for event in events:
                event.wall_time = time.time()
                RecordWriter(records).write(event.SerializeToString())
            append_whole(self._file, records.getvalue())
        except InputError as error:
            self._has_failed = True
            warn(f"{error}; training goes on without TensorBoard")

    def _begin(self) -> list[Event]:
        """Choose the file, whose name is sorted after those of earlier sessions; returns what it begins with."""
        started = [int(n) for path in self._path.glob(f"{_NAME}.*") if (n := path.name.split(".")[3]).isdigit()]
        number = max([int(time.time()), *(before + 1 for before in started)])
        self._file = self._path / f"{_NAME}.{number:010d}.{socket.gethostname()}.{os.getpid()}.0"
        begin = Event(file_version="brain.Event:2")
        if not started:
            return [begin]
        return [begin, Event(step=self._begins_after + 1, session_log=SessionLog(status=SessionLog.START))]

    def sync(self) -> None:
        """Have the events outlive a loss of power."""
        if self._file is not None and not self._has_failed:
            with suppress(InputError):  # the next one will tell
                sync(self._file)

    def _add(self, scalars: Mapping[str, float], steps: int) -> None:
        self._write(*(Event(step=steps, summary=scalar(name, value)) for name, value in scalars.items()))

    def add_metrics(self, row: Mapping[str, float]) -> None:
        """Show a row of ``metrics.csv``."""
        self._add({tag(name): value for name, value in row.items() if name != "steps"}, int(row["steps"]))

    def add_evaluation(self, steps: int, evaluation: Evaluation) -> None:
        """Show an evaluation: in all, by goal, and where there are several goal graphs by graph."""
        scalars = _scalars("eval", evaluation)
        for goal, (share, _) in evaluation.steps_to_goals.items():
            scalars[f"eval/achieved/{goal.replace(' ', '_')}"] = share
        if len(evaluation.graphs) > 1:
            for graph, score in evaluation.graphs.items():
                scalars |= _scalars(f"eval/graph/{graph}", score)
        self._add(scalars, steps)

    def add_hyperparameters(self, curve: LearningCurve | None) -> None:
        """Show the run's config beside how it ended, in TensorBoard's table of runs."""
        entries = {name: value for name, value in self._config.entries.items() if name not in ("env", "agents", "ppo")}
        plain = {
            name: value if isinstance(value, (bool, int, float, str)) else str(value) for name, value in entries.items()
        }
        ends = {}
        if curve is not None:
            ends = {"eval/success_rate": curve.success[-1], "eval/length": curve.length[-1]}
            crossings = {milestone: curve.crossing(milestone) for milestone in MILESTONES}
            ends |= {f"eval/steps_to_{name}": at.steps for name, at in crossings.items() if at is not None}
        steps = self._config.steps
        self._write(*(Event(step=steps, summary=summary) for summary in hparams(plain, ends)))
        self._add({name: value for name, value in ends.items() if "steps_to" in name}, steps)


def _scalars(group: str, score: Score) -> dict[str, float]:
    numbers = {"success_rate": score.success_rate, "length": score.length, "return": score.mean_return}
    numbers["length_over_shortest"] = score.length_over_shortest
    return {f"{group}/{name}": value for name, value in numbers.items()}
