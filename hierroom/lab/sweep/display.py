"""What a sweep shows while it goes on: a line for each run at work, and how much is left of all."""

from __future__ import annotations

import time
from collections.abc import Iterable
from types import TracebackType

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from hierroom.lab.sweep.events import Event, Failed, Finished, Interrupted, Progressed, Retried
from hierroom.lab.sweep.job import Job


class Display:
    """Shows what happens to the jobs of a sweep; on a terminal it is live.

    Args:
        jobs: what is to be done.
        console: where to show it.
    """

    def __init__(self, jobs: Iterable[Job], console: Console) -> None:
        self._console = console
        self._jobs = {job.run.digest: job for job in jobs}
        self._at_work: dict[str, tuple[int, str]] = {}
        self._steps_done = self._n_done = 0
        self._bar = Progress(
            TextColumn("{task.fields[done]} of {task.fields[runs]} runs"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f}% of the steps, {task.fields[speed]}"),
            TimeElapsedColumn(),
            TextColumn("gone,"),
            TimeRemainingColumn(),
            TextColumn("left"),
            speed_estimate_period=600,
            console=console,
        )
        total = sum(job.run.config.steps for job in self._jobs.values())
        self._task = self._bar.add_task("", total=total, done=0, runs=len(self._jobs), speed="")
        self._live = Live(self._content(), console=console, refresh_per_second=2)
        self._trained_here = 0
        self._started = time.monotonic()

    def __enter__(self) -> Display:
        if self._console.is_terminal:
            self._live.__enter__()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._at_work.clear()
        self._update()
        if self._console.is_terminal:
            self._live.__exit__(kind, error, trace)  # pyright: ignore[reportArgumentType]

    def show(self, event: Event) -> None:
        """Show what has happened."""
        job = event.job
        name, digest = job.run.name, job.run.digest
        before = self._at_work.pop(digest, (0, ""))[0]
        if isinstance(event, Progressed):
            self._trained_here += event.steps - before if before else 0  # a resumed run begins with what it had
            self._at_work[digest] = (event.steps, event.words)
        if isinstance(event, Finished):
            success, length = event.numbers["success_rate"], event.numbers["length"]
            self._say(f"{self._n_done + 1}/{len(self._jobs)} {name}: success {success:.1%}, length {length:.0f}")
        elif isinstance(event, Failed):
            self._say(f"failed: {name}: {event.reason}")
        elif isinstance(event, Retried):
            self._say(f"{name}: its process was killed or stopped; it goes on from its last checkpoint")
        elif isinstance(event, Interrupted):
            self._say(f"{name}: stopped and saved")
        if isinstance(event, Finished | Failed):
            self._n_done += 1
            self._steps_done += job.run.config.steps
        self._update()

    def _say(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    def _update(self) -> None:
        seconds = time.monotonic() - self._started
        completed = self._steps_done + sum(steps for steps, _ in self._at_work.values())
        speed = f"{self._trained_here / seconds:,.0f} steps/s" if seconds > 0 else ""
        self._bar.update(self._task, completed=completed, done=self._n_done, speed=speed)
        self._live.update(self._content())

    def _content(self) -> Group:
        table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
        for digest, (steps, words) in self._at_work.items():
            job = self._jobs[digest]
            share = min(1.0, steps / job.run.config.steps)
            table.add_row(escape(job.run.name), f"{share:.0%}", escape(words.rstrip(",")))
        return Group(table, self._bar)
