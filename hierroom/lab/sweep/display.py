"""The display of a sweep while it runs: a line for each active run, and the remaining work of all."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from hierroom.agents.evaluation import outcome_in_words
from hierroom.lab.sweep.job import Event, Job
from hierroom.runs.folder.run_folder import RunFolder


class Display:
    """The progress of a sweep's jobs on standard error: bars on a terminal, and a line for each job that ends."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        console = Console(stderr=True)
        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:3.0f}% of the steps, {task.fields[words]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("gone,"),
            TimeRemainingColumn(),
            TextColumn("left"),
            speed_estimate_period=600,
            refresh_per_second=2,
            console=console,
            disable=not console.is_terminal,
        )
        self._at_work: dict[str, TaskID] = {}  # by digest
        self._remaining = {job.run.digest: _remaining(job, RunFolder(job.folder).saved_steps) for job in jobs}
        self._n_jobs, self._n_ended, self._trained = len(jobs), 0, 0
        self._started = time.monotonic()
        self._all = self._bars.add_task("", total=sum(self._remaining.values()), words="")

    def __enter__(self) -> Display:
        self._bars.start()
        return self

    def __exit__(self, *error: object) -> None:
        for task in self._at_work.values():
            self._bars.remove_task(task)
        self._bars.stop()

    def say(self, line: str) -> None:
        """Show a line above the bars."""
        self._bars.console.print(line, markup=False, highlight=False, soft_wrap=True)

    def show(self, event: Event) -> None:
        """Show an event."""
        run = event.job.run
        if event.kind == "progressed":
            steps, words = event.content
            if run.digest not in self._at_work:
                self._at_work[run.digest] = self._bars.add_task(run.name, total=run.config.steps, words="")
            remaining = _remaining(event.job, steps)
            self._trained += self._remaining[run.digest] - remaining
            self._remaining[run.digest] = remaining
            self._bars.update(self._at_work[run.digest], completed=steps, words=words.rstrip(","))
        else:
            if run.digest in self._at_work:
                self._bars.remove_task(self._at_work.pop(run.digest))
            if event.kind in ("finished", "failed", "done elsewhere"):
                self._n_ended += 1
                self._remaining[run.digest] = 0
            self.say(_line(event, f"{self._n_ended}/{self._n_jobs}"))
        self._bars.update(
            self._all,
            description=f"{self._n_ended} of {self._n_jobs} runs",
            completed=self._trained,  # without the steps of resumed and failed runs, else the time left is too short
            total=self._trained + sum(self._remaining.values()),
            words=f"{self._trained / (time.monotonic() - self._started):,.0f} steps/s",
        )


def _remaining(job: Job, steps: int) -> int:
    return max(job.run.config.steps - steps, 0)


def _line(event: Event, count: str) -> str:
    name, content = event.job.run.name, event.content
    match event.kind:
        case "finished":
            played = f"{content['evaluated_episodes']} episodes"
            numbers = (content.get(name, math.nan) for name in ("success_rate", "return", "score"))
            outcome = " ".join(outcome_in_words(*numbers, digits=1))
            return f"{count} {name}: {outcome}, length {content['length']:.0f} in {played}"
        case "failed":
            return f"failed: {name}: {content}"
        case "busy":
            return f"{name}: another process trains it, and is waited for"
        case "done elsewhere":
            return f"{count} {name}: another process has done it"
        case "retried":
            return f"{name}: its process was killed or stopped; it goes on from its last checkpoint"
        case "unsaved":
            return f"{name}: killed, as it did not stop; it will go on from its last checkpoint"
    return f"{name}: stopped and saved"
