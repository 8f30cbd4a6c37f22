"""Steps per second of training on more cores: threads in one run, and runs side by side as a sweep has them.

    python -m benchmarks.core_speed

HiPPO on graph g with the preset default. Runs side by side have one thread and 64 environments each, and are timed
together once all have compiled. Threads share the work of one run, which pays from many environments on.
"""

from __future__ import annotations

import multiprocessing as mp
import os
import time
from dataclasses import dataclass
from multiprocessing.synchronize import Barrier
from statistics import median

import tyro

from benchmarks.device_speed import measured, spread
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import cpu_name
from hierroom.runs.trainer import Trainer
from hierroom.support.cli import run
from hierroom.worlds.env_config import EnvConfig


@dataclass(frozen=True)
class Options:
    """Time training on several cores.

    Args:
        cores: how many to try next to one; those that the machine lacks are left out.
        num_envs: environments of the run with several threads.
        repeats: updates that are timed, after one that is not.
    """

    cores: tuple[int, ...] = (1, 2, 4, 8, 16)
    num_envs: int = 512
    repeats: int = 3


def trainer(num_envs: int, threads: int, seed: int = 0) -> Trainer:
    """Return a fresh trainer."""
    return Trainer(TrainConfig(EnvConfig("g"), steps=10**9, num_envs=num_envs, threads=threads, seed=seed))


def side_by_side(processes: int, updates: int) -> float:
    """Return the steps per second of so many single-threaded runs together."""
    context = mp.get_context("spawn")
    barrier, queue = context.Barrier(processes), context.Queue()
    workers = [context.Process(target=_train, args=(barrier, queue, seed, updates)) for seed in range(processes)]
    for worker in workers:
        worker.start()
    found = [queue.get() for _ in workers]
    for worker in workers:
        worker.join()
    return sum(steps for steps, _ in found) / max(seconds for _, seconds in found)


def _train(barrier: Barrier, queue: mp.Queue, seed: int, updates: int) -> None:
    one = trainer(64, 1, seed)
    one.advance()
    before = one.steps
    barrier.wait()
    started = time.perf_counter()
    for _ in range(updates):
        one.advance()
    queue.put((one.steps - before, time.perf_counter() - started))


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    cores = [n for n in sorted({1, *options.cores}) if n <= len(os.sched_getaffinity(0))]
    print(f"{cpu_name()}, {os.cpu_count()} cores\n")
    print("| cores | one run, steps/s | / one thread | runs side by side, steps/s | / one run |")
    print("|---:|---:|---:|---:|---:|")
    threaded = measured([trainer(options.num_envs, threads) for threads in cores], options.repeats)
    together = [side_by_side(processes, 4 * options.repeats) for processes in cores]
    for n, own, speed in zip(cores, threaded, together, strict=True):
        ratio, several = median(own) / median(threaded[0]), speed / together[0]
        print(f"| {n} | {spread(own)} | {ratio:.2f} | {speed:,.0f} | {several:.2f} |")
    return 0


if __name__ == "__main__":
    run(main)
