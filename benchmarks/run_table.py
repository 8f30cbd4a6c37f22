"""A table of training runs in a CSV file, filled by several processes and gone on with where it was stopped.

Rows do not tell that a preset has changed since they were made: then delete them.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import torch
from rich.progress import Progress

from hierroom.errors import InputError
from hierroom.training.config import TrainConfig
from hierroom.training.episode_log import WINDOW
from hierroom.training.learning_curve import MILESTONES
from hierroom.training.trainer import Trainer

Key = dict[str, str]
"""What tells a row from the others: column and text."""


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a table, none if it is not there."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def fill(
    path: Path,
    runs: Sequence[tuple[Key, TrainConfig]],
    work: Callable[[TrainConfig], dict[str, object]],
    processes: int,
) -> list[dict[str, str]]:
    """Run what the table lacks, with a progress bar, and return the rows of the runs.

    Args:
        path: the CSV file; a new one begins with the command that made it.
        runs: key and config of each run, at least one.
        work: trains a config and returns the row's other columns.
        processes: runs at a time.

    Raises:
        InputError: if the file has other columns than the rows that would be added.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    names = list(runs[0][0])
    held = [{name: row[name] for name in names} for row in read(path)]
    missing = [(key, config) for key, config in runs if key not in held]
    with Progress() as bar, ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        task = bar.add_task("runs", total=len(missing))
        futures = {pool.submit(work, config): key for key, config in missing}
        for future in as_completed(futures):
            if future.exception():
                pool.shutdown(cancel_futures=True)
            _append(path, {**futures[future], **future.result()})
            bar.advance(task)
    keys = [key for key, _ in runs]
    return [row for row in read(path) if {name: row[name] for name in names} in keys]


def _append(path: Path, row: dict[str, object]) -> None:
    held, is_new = read(path), not path.exists()
    if held and list(held[0]) != list(row):
        raise InputError(f"{path} has the columns {', '.join(held[0])}, not {', '.join(row)}; give another --out")
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, list(row))
        if is_new:
            file.write(f"# python {' '.join(sys.argv)}\n")
            writer.writeheader()
        writer.writerow(row)


def train(config: TrainConfig) -> tuple[Trainer, dict[str, object]]:
    """A trainer that took all steps of its config, and the numbers of its row.

    The steps to a success rate are those after which so many of the last 500 episodes of training had escaped.
    """
    torch.set_num_threads(1)  # the processes are the parallel part
    trainer, steps_to, seconds_to = Trainer(config), {}, {}
    while not trainer.is_done:
        trainer.advance()
        for milestone in MILESTONES if trainer.log.episodes >= WINDOW else ():
            if milestone not in steps_to and trainer.log.success_rate >= milestone / 100:
                steps_to[milestone], seconds_to[milestone] = trainer.steps, trainer.seconds
    names = ("success_rate", "episode_length", "episodes", "seconds", "steps_per_second", "rollout_bytes")
    numbers = {name: trainer.summary()[name] for name in names}
    numbers |= {f"steps_to_{milestone}": steps_to.get(milestone) for milestone in MILESTONES}
    return trainer, numbers | {f"seconds_to_{milestone}": seconds_to.get(milestone) for milestone in MILESTONES}


def in_millions(steps: float) -> str:
    """Steps as people read them, or a dash where a milestone was not reached."""
    return f"{steps / 1e6:.2f}M" if steps < float("inf") else "-"
