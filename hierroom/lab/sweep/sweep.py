"""A sweep on disk: find the runs that are done, and do the others."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hierroom.lab.sweep.plan import Plan, PlannedRun
from hierroom.lab.sweep.table import SweepTable
from hierroom.runs.folder.user_code import user_code_digest
from hierroom.support.errors import InputError, require_number
from hierroom.support.files import usable_path
from hierroom.support.output import said_in_turn

if TYPE_CHECKING:
    import pandas as pd

    from hierroom.lab.sweep.job import Event, Job
    from hierroom.support.interrupt import Interrupt


@dataclass(frozen=True)
class Shard:
    """A part of a sweep's runs, for one of several machines: the ``number``-th of ``count``, counted from 1."""

    number: int = 1
    count: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Return the shard that ``3/8`` means."""
        number, _, count = text.partition("/")
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count) <= 10**6):
            raise InputError(f"a shard is NUMBER/COUNT such as 3/8, the third of eight, not {text!r}")
        return cls(int(number), int(count))

    def of(self, runs: Sequence[PlannedRun]) -> tuple[PlannedRun, ...]:
        """Return every ``count``-th run, from the ``number``-th on."""
        return tuple(runs[self.number - 1 :: self.count])


@dataclass(frozen=True)
class Sweep:
    """The runs of a plan, in a folder with the table ``sweep.csv`` and the runs' folders in ``runs/``."""

    plan: Plan
    out: Path

    def __post_init__(self) -> None:
        if usable_path(self.out).exists() and not self.out.is_dir():
            raise InputError(f"the runs and their table are written to a folder; {self.out} is none")
        if (self.out / "config.json").exists():
            raise InputError(f"{self.out} is the folder of a single run; choose another --out")

    @property
    def table(self) -> SweepTable:
        """The rows of the runs that are done."""
        return SweepTable(self.out)

    def rows(self) -> pd.DataFrame:
        """Return the rows of the plan's runs that are done."""
        return self.table.of(self.plan.runs())

    def made_with_other_code(self) -> list[str]:
        """Return the names of finished runs with custom code that has changed since, by the digests in their rows."""
        rows = self.table.read()
        before = dict(zip(rows["digest"], rows.get("own_code", ()), strict=False))
        done = [run for run in self.plan.runs() if before.get(run.digest)]
        now = {run.digest: user_code_digest(run.config, self.plan.metas) for run in done}
        return [run.name for run in done if now[run.digest] and before[run.digest] != now[run.digest]]

    def fill(
        self,
        *,
        processes: int | None = None,
        ray: str | None = None,
        shard: Shard = Shard(),
        command: str = "",
        watch: Callable[[Event], bool] = lambda event: False,
    ) -> SweepOutcome:
        """Do the missing runs of a shard, in processes or on a Ray cluster; ``command`` is written to their rows.

        ``watch`` gets each event, and may return True to end all runs, which stay as they are.
        """
        runs = shard.of(self.plan.runs())
        self.table.complete(runs)
        have = {*self.table.of(runs)["digest"]}
        missing = [run for run in runs if run.digest not in have]
        self.check(missing, processes)
        if not missing:
            return SweepOutcome((), (), False)
        # These import torch, which a finished sweep does not need.
        from hierroom.lab.sweep.cluster import work_on_cluster
        from hierroom.lab.sweep.display import Display
        from hierroom.lab.sweep.job import Job
        from hierroom.lab.sweep.pool import work_here
        from hierroom.runs.folder.run_folder import RunFolder
        from hierroom.support.interrupt import Interrupt

        folder = self.out / "runs"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"cannot create the folder {folder}: {error.strerror}") from error
        jobs = [Job(run, folder / run.name, self.plan.episodes, self.plan.metas, command) for run in missing]
        failures: list[tuple[PlannedRun, str]] = []
        replaced: list[PlannedRun] = []
        n_cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        with Display(jobs) as display, Interrupt(say=display.say) as interrupt:
            while jobs:
                here = work_here(jobs, processes or n_cores, interrupt, self._is_done)
                busy = []
                with closing(here if ray is None else work_on_cluster(jobs, ray, interrupt)) as events:
                    for event in events:
                        run = event.job.run
                        if event.kind == "finished":
                            evaluations = RunFolder(event.job.folder).evaluations.read()
                            if self.table.add(run, event.content, evaluations):
                                replaced.append(run)
                        elif event.kind == "failed":
                            failures.append((run, event.content))
                        elif event.kind == "busy":
                            busy.append(event.job)
                        display.show(event)
                        if watch(event):
                            return SweepOutcome(tuple(failures), tuple(replaced), False)
                jobs = self._awaited(busy, interrupt)
        return SweepOutcome(tuple(failures), tuple(replaced), interrupt.is_requested)

    def _is_done(self, job: Job) -> bool:
        return bool((self.table.read()["digest"] == job.run.digest).any())

    def _awaited(self, busy: list[Job], interrupt: Interrupt) -> list[Job]:
        """Wait until another process ends work on one of the jobs; return all jobs, or none if interrupted."""
        from hierroom.runs.folder.run_folder import RunFolder

        while busy and not interrupt.is_requested:
            if any(self._is_done(job) or not RunFolder(job.folder).lock.is_held for job in busy):
                return busy
            time.sleep(1)
        return []

    def check(self, runs: Sequence[PlannedRun], processes: int | None) -> None:
        """Refuse runs that cannot be trained, meta-controllers that cannot be made, and a wrong number of processes."""
        from hierroom.meta import make_meta

        if processes is not None:
            require_number("processes", processes, 1, 1024, is_whole=True)
        for meta in self.plan.metas:
            make_meta(meta)
        if not runs:
            return
        from hierroom.runs.trainer import Trainer  # imports torch

        # Check one seed for all, on the CPU, as the machine that trains may have a device that this one lacks.
        alike = {replace(run.config, seed=0, device="cpu"): run for run in runs}
        for config, run in said_in_turn(f"checking {len(alike)} configs", [*alike.items()]):
            try:
                Trainer(config).turns.world.close()
            except InputError as error:
                raise InputError(f"{run.name} cannot be trained: {error}") from error


@dataclass(frozen=True)
class SweepOutcome:
    """The outcome of trying to do the runs of a sweep."""

    failures: tuple[tuple[PlannedRun, str], ...]  # the runs that could not be done, and why
    replaced: tuple[PlannedRun, ...]  # the runs with rows that replace those of other configs
    is_interrupted: bool
