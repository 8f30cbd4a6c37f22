"""Steps per second of training with the learner on the CPU and on a GPU, by the size of the network.

    python benchmarks/device_speed.py
    python benchmarks/device_speed.py --hidden-sizes 64 256 --num-envs 512

HiPPO on graph g with the settings of preset default, but for the number of hidden units and of environments. On the CPU
the learner runs its compiled kernels; on a GPU it runs through torch, and the world stays on the CPU. Repeats take
turns, so that a busy machine slows all alike.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from statistics import median

import torch
import tyro

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import cpu_name
from hierroom.runs.trainer import Trainer
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig


@dataclass(frozen=True)
class Options:
    """Time training on each device."""

    hidden_sizes: tuple[int, ...] = (64, 256, 1024)
    """Hidden units of the network."""
    num_envs: tuple[int, ...] = (64,)
    """Environments side by side."""
    repeats: int = 3
    """Updates of each that are timed, after one that is not."""
    threads: int = 2
    """Threads of the compiled kernels, and of the world."""


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    if not torch.cuda.is_available():
        raise InputError("this machine has no GPU that torch can use")
    print(f"{cpu_name()}, {os.cpu_count()} cores; {torch.cuda.get_device_name()}")
    print(f"torch {torch.__version__}; {options.repeats} updates after one to warm up: median (lowest to highest)\n")
    print(f"{'hidden':>6} {'num_envs':>8} {'CPU steps/s':>26} {'GPU steps/s':>26} {'GPU / CPU':>10}")
    for hidden_size in options.hidden_sizes:
        for num_envs in options.num_envs:
            config = TrainConfig(EnvConfig("g"), steps=10**9, num_envs=num_envs, threads=options.threads)
            config = config.changed(hidden_size=hidden_size)
            cpu, gpu = measured([Trainer(config.changed(device=device)) for device in ("cpu", "cuda")], options.repeats)
            print(
                f"{hidden_size:6} {num_envs:8} {spread(cpu):>26} {spread(gpu):>26} {median(gpu) / median(cpu):10.2f}",
                flush=True,
            )
    return 0


def measured(trainers: list[Trainer], repeats: int) -> list[list[float]]:
    """Primitive steps per second of each update, by trainer."""
    speeds: list[list[float]] = [[] for _ in trainers]
    for repeat in range(repeats + 1):
        for trainer, its_speeds in zip(trainers, speeds, strict=True):
            started, steps = time.perf_counter(), trainer.steps
            trainer.advance()  # ends with numbers that are on the CPU, so that nothing is left to wait for
            if repeat:
                its_speeds.append((trainer.steps - steps) / (time.perf_counter() - started))
    return speeds


def spread(values: list[float]) -> str:
    """Median, lowest and highest."""
    return f"{median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f})"


if __name__ == "__main__":
    run(main)
