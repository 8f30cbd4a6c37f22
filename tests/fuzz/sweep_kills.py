"""Kill sweeps and all their processes, go on with them, and compare tables and run folders with undisturbed ones.

``python tests/fuzz/sweep_kills.py --kills 20`` kills each command so often: every other time right before a file
operation of the sweep itself or of one of its workers, where half of these, if they are to write, do the first half of
it, and every other time at a random moment. Many are killed again after they went on. Exit code 1 says that something
differs, and the places are told.
"""

from __future__ import annotations

import csv
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import tyro
from places import told_to

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]  # the tests, and the package

from same_run import differences  # noqa: E402

from hierroom.support.cli import run  # noqa: E402

COMMANDS = {
    "sweep": "sweep method=hippo,ppo-rnd meta=none,random steps=8_000 size=11 num_envs=8 evaluations=4 "
    "evaluation_episodes=20 --seeds 2 --episodes 20 --processes 2",
    "paper": "paper table3 --steps 40_000 --seeds 1 --graphs a c --evaluations 3 "
    "--evaluation-episodes 20 --episodes 20 --processes 2",
}
TABLES = ("sweep.csv", "curves.csv")
ROLES = ("main", "worker")
"""Of the processes of a command."""
APART = ("seconds", "steps_per_second")
"""Columns that tell the time."""


@dataclass(frozen=True)
class Options:
    """Kill sweeps.

    Args:
        kills: of each command.
        seed: fixes the moments and the operations.
        commands: which, of sweep and paper.
    """

    kills: int = 20
    seed: int = 0
    commands: tuple[Literal["sweep", "paper"], ...] = ("sweep", "paper")


@dataclass
class Command:
    """A command that is killed, and what it leaves when it is left alone.

    Args:
        words: the command.
        place: a folder to work in.
        random: draws the kills.
    """

    words: Sequence[str]
    place: Path
    random: random.Random
    killed: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.site = self.place / "site"
        self.site.mkdir(parents=True)
        # The folders have one name, which stands in pictures.
        self.alone, self.out = self.place / "alone" / "out", self.place / "killed" / "out"
        started = time.monotonic()
        process = self._start(self.alone, told_to(self.alone, self.site))
        assert process.wait() == 0, (self.place / "log").read_text()
        self.seconds = time.monotonic() - started
        counted = Counter((self.site / "counts").read_text().splitlines())
        self.operations = {role: max(n for who, n in counted.items() if who.startswith(role)) for role in ROLES}

    def _start(self, out: Path, environment: dict[str, str] | None = None) -> subprocess.Popen:
        """The command, in a process group of its own, writing to a folder."""
        command = [sys.executable, "-m", "hierroom", *self.words, "--out", str(out)]
        with (self.place / "log").open("w") as log:
            return subprocess.Popen(command, start_new_session=True, stdout=log, stderr=log, env=environment)

    def kill(self) -> str:
        """Begin it or go on with it, and kill it; returns where, or nothing where it had ended before."""
        if self.killed["operation"] <= self.killed["moment"]:
            role, is_torn = self.random.choice(ROLES), self.random.random() < 0.5
            at = self.random.randrange(self.operations[role])
            kind, where = "operation", f"{'in' if is_torn else 'before'} operation {at} of a {role}"
            process = self._start(self.out, told_to(self.out, self.site, role, at, is_torn))
        else:
            seconds = self.random.uniform(0, self.seconds)
            kind, where = "moment", f"after {seconds:.1f} s"
            process = self._start(self.out)
            with suppress(subprocess.TimeoutExpired):
                process.wait(seconds)
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        code = process.wait()
        if code == 0:
            return ""
        assert code == -signal.SIGKILL, (self.place / "log").read_text()
        self.killed[kind] += 1
        return where

    def finish(self) -> list[str]:
        """Go on to the end; returns what differs, and takes the folder away if nothing does."""
        if self._start(self.out).wait() != 0:
            return [(self.place / "log").read_text()]
        found = [f"{table} differs" for table in TABLES if rows(self.alone / table) != rows(self.out / table)]
        runs = [{one.name for one in (out / "runs").iterdir()} for out in (self.alone, self.out)]
        found += [f"runs/{name} is in one only" for name in sorted(runs[0] ^ runs[1])]
        for name in sorted(runs[0] & runs[1]):
            lines = differences(self.alone / "runs" / name, self.out / "runs" / name)
            found += [f"runs/{name}: {line}" for line in lines]
        if not found:
            shutil.rmtree(self.out)
        return found


def rows(path: Path) -> list[dict[str, str]]:
    """A table but for what may differ, in one order."""
    with path.open(newline="") as file:
        kept = [{k: v for k, v in row.items() if not k.startswith(APART)} for row in csv.DictReader(file)]
    return sorted(kept, key=lambda row: (row["digest"], float(row["steps"])))


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    n_wrong = 0
    for name in options.commands:
        with TemporaryDirectory() as place:
            command = Command(COMMANDS[name].split(), Path(place), random.Random(options.seed))
            n_sweeps, wrong = 0, 0
            while command.killed.total() < options.kills:
                told, n_sweeps = list[str](), n_sweeps + 1
                for _ in range(command.random.choice((1, 2, 3, 4))):
                    if command.killed.total() == options.kills or not (where := command.kill()):
                        break
                    told.append(where)
                if found := command.finish():
                    print(f"{name}, killed {', '.join(told)}: {'; '.join(found)}", flush=True)
                    command.out.rename(command.out.with_name(f"wrong{n_sweeps}"))
                    wrong += 1
            n_runs = len(rows(command.alone / TABLES[0]))
            print(
                f"{name}: {command.killed['operation']} kills at a file operation, {command.killed['moment']} at a "
                f"moment, in {n_sweeps} sweeps of {n_runs} runs: {wrong} differ in a table or a run's folder",
                flush=True,
            )
            n_wrong += wrong
    return min(1, n_wrong)


if __name__ == "__main__":
    run(main)
