"""Microseconds a choice of the two ways to write a meta-controller: for all environments, or level by level.

    python benchmarks/meta_speed.py

Both are those of `examples/own_meta_controller.py`; the third is fixed DFS, which ships. Each repeat times each of them
once in the same situations, one after another, so that a busy machine slows them all. Each gets a new object, as a
situation keeps what was once computed of it.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles

import numpy as np
import tyro

from hierroom.meta import FixedDFS, LevelMeta, choose_goals
from hierroom.runs.folder.provenance import cpu_name
from hierroom.support.cli import run
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig

sys.path.append(str(Path(__file__).resolve().parents[1] / "examples"))
from own_meta_controller import NearestKeyFirst, nearest


@dataclass(frozen=True)
class Options:
    """Time choices.

    Args:
        num_envs: environments of one call.
        repeats: timed passes over all of them, after one that is not.
    """

    num_envs: int = 256
    repeats: int = 20


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    turns = Turns(EnvConfig("g"), options.num_envs, seed=0)
    metas = {
        "FixedDFS, all at once": FixedDFS(),
        "NearestKeyFirst, all at once": NearestKeyFirst(),
        "nearest, level by level": LevelMeta(nearest),
    }
    spent: dict[str, list[float]] = {name: [] for name in metas}
    for repeat in range(options.repeats + 1):
        for name, meta in metas.items():
            situation = turns.situation(np.arange(options.num_envs))
            started = time.perf_counter()
            choose_goals(meta, situation)
            if repeat:
                spent[name].append(1e6 * (time.perf_counter() - started) / options.num_envs)
    print(f"{cpu_name()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    print(f"{options.num_envs} environments, {options.repeats} repeats; median (quartiles) microseconds a choice")
    fastest = min(median(values) for values in spent.values())
    for name, values in spent.items():
        low, middle, high = quantiles(values, n=4)
        print(f"{name:30} {middle:8.2f}  ({low:.2f} to {high:.2f})  {middle / fastest:6.1f} x")
    return 0


if __name__ == "__main__":
    run(main)
