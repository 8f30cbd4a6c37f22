"""Kill a sweep and all its processes at random moments, go on with it, and compare its tables with undisturbed ones.

python tests/fuzz/sweep_kills.py --kills 10 --seed 1
"""

from __future__ import annotations

import csv
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import tyro

from hierroom.cli import run

COMMANDS = {
    "sweep": (
        *("hierroom.sweep", "method=hippo,ppo-rnd", "meta=none,random", "steps=20_000", "size=11", "num_envs=8"),
        *("evaluations=4", "evaluation_episodes=20", "--seeds", "2", "--episodes", "20", "--processes", "2"),
    ),
    "paper": (
        *("hierroom.paper", "table3", "--steps", "40_000", "--seeds", "1", "--graphs", "a", "c", "--evaluations", "3"),
        *("--evaluation-episodes", "20", "--episodes", "20", "--processes", "2"),
    ),
}
APART = ("seconds", "steps_per_second")
"""Columns that tell the time."""


@dataclass(frozen=True)
class Options:
    """Kill sweeps.

    Args:
        kills: of each command.
        seed: fixes the moments.
        seconds: the longest that a command works before it is killed.
    """

    kills: int = 10
    seed: int = 0
    seconds: float = 60.0


def rows(out: Path, name: str) -> list[dict[str, str]]:
    """A table but for what may differ, in one order."""
    with (out / name).open(newline="") as file:
        kept = [{k: v for k, v in row.items() if not k.startswith(APART)} for row in csv.DictReader(file)]
    return sorted(kept, key=lambda row: (row["digest"], float(row["steps"])))


def start(words: tuple[str, ...], out: Path) -> subprocess.Popen:
    """The command, in a process group of its own, writing to a folder."""
    command = [sys.executable, "-m", *words, "--out", str(out)]
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def kill_all(process: subprocess.Popen) -> None:
    """Kill the command and the processes that it began."""
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    chosen = random.Random(options.seed)
    n_wrong = 0
    for name, words in COMMANDS.items():
        with TemporaryDirectory() as place:
            whole, killed = Path(place, "out"), Path(place, "killed")
            code = start(words, whole).wait()
            n_kills = 0
            while n_kills < options.kills:
                process, end = start(words, killed), time.monotonic() + chosen.uniform(0, options.seconds)
                while time.monotonic() < end and process.poll() is None:
                    time.sleep(0.02)
                if process.poll() is None:
                    kill_all(process)
                    n_kills += 1
                else:  # it was done before its moment came: begin again from nothing
                    for path in sorted(killed.rglob("*"), reverse=True):
                        path.rmdir() if path.is_dir() else path.unlink()
            again = start(words, killed).wait()
            tables = ("sweep.csv", "curves.csv")
            equal = code == again == 0 and all(rows(whole, table) == rows(killed, table) for table in tables)
            n_wrong += not equal
            print(f"{name}: {n_kills} kills, {len(rows(whole, tables[0]))} runs, equal: {equal}", flush=True)
    return min(1, n_wrong)


if __name__ == "__main__":
    run(main)
