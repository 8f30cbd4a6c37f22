"""What a sweep shows while it runs: a line for each run at work, and how much is left of all."""

from __future__ import annotations

import time
from collections.abc import Iterable
from types import TracebackType

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from hierroom.lab.sweep.job import Event, Failed, Finished, Interrupted, Job, Progressed, Retried


class Display:
    """A live display of a sweep's jobs, on a terminal; elsewhere a line for each that ends."""

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
        run = event.job.run
        before = self._at_work.pop(run.digest, (0, ""))[0]
        if isinstance(event, Finished | Failed):
            self._n_done += 1
            self._steps_done += run.config.steps
        match event:
            case Progressed(_, steps, words):
                self._trained_here += steps - before if before else 0  # a resumed run begins with what it had
                self._at_work[run.digest] = (steps, words)
            case Finished(_, numbers):
                result = f"success {numbers['success_rate']:.1%}, length {numbers['length']:.0f}"
                self._say(f"{self._n_done}/{len(self._jobs)} {run.name}: {result}")
            case Failed(_, reason):
                self._say(f"failed: {run.name}: {reason}")
            case Retried():
                self._say(f"{run.name}: its process was killed or stopped; it goes on from its last checkpoint")
            case Interrupted():
                self._say(f"{run.name}: stopped and saved")
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
            run = self._jobs[digest].run
            table.add_row(escape(run.name), f"{min(1.0, steps / run.config.steps):.0%}", escape(words.rstrip(",")))
        return Group(table, self._bar)
