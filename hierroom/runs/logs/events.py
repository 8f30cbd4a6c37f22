"""Events of a run, for TensorBoard."""

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

from hierroom.runs.logs.scalars import Logger, Plain
from hierroom.support.errors import InputError
from hierroom.support.files import append_whole, sync

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

    def sync(self) -> None:
        """Make the events survive a loss of power."""
        if self._file is not None:
            with suppress(InputError):  # the next event fails too, and reports it
                sync(self._file)
