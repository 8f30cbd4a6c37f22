"""Steps per second of the world and of MiniGrid, in the same process and minute.

    python benchmarks/world_speed.py

Random actions, graph c, a fresh observation [N, 7, 7, 3] uint8 from every step, episodes that begin by themselves.
MiniGrid plays the very same level (`tests/minigrid_level.py`), without Gymnasium's wrappers. Each repeat times each
case once, one after another, so that a busy machine slows them all: the ratios are more telling than the speeds. A
second thread is used only where each has `thread_pool.MIN_ENVS_PER_THREAD` environments to step. "Remembering all"
keeps the memories that features and rewards may ask for, which nobody asks for otherwise.
Floors, on one thread: 500 times MiniGrid at 128 environments, and 75 times for one environment.
"""

import argparse
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from itertools import product
from pathlib import Path

import numpy as np

from hierroom.goals import GoalGraph
from hierroom.runs.folder.provenance import cpu_name
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import MEMORIES
from hierroom.worlds.escape_room.tiles import encode

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from minigrid_level import MiniGridLevel

CASES = [*product((1, 128, 1024, 8192), (1, 2), ((),)), (128, 1, tuple(MEMORIES))]  # environments, threads, memories
MIN_RATIOS = {128: 500, 1: 75}
"""Floors for the ratio to MiniGrid, by the number of environments on one thread."""


def our_stepper(num_envs: int, threads: int, memories: tuple[str, ...], size: int) -> Callable[[int], None]:
    """Return a function that takes some steps in every environment."""
    world = Engine([GoalGraph.named("c")], num_envs, size=size, threads=threads, memories=memories)
    actions = list(np.random.default_rng(0).integers(world.n_actions, size=(64, num_envs)))

    def run(steps: int) -> None:
        for t in range(steps):
            world.step(actions[t % 64])
            encode(world.outcomes["tiles"])

    return run


def minigrid_stepper(size: int) -> Callable[[int], None]:
    """Return the same in one MiniGrid environment."""
    env = MiniGridLevel(Engine([GoalGraph.named("c")], size=size).state)
    env.reset()
    actions = np.random.default_rng(0).integers(5, size=1024).tolist()

    def run(steps: int) -> None:
        for t in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[t % 1024])
            if terminated or truncated:
                env.reset()

    return run


def steps_per_second(run: Callable[[int], None], num_envs: int, seconds: float) -> float:
    steps, elapsed, chunk = 0, 0.0, max(1, 2_000 // num_envs)
    start = time.perf_counter()
    while elapsed < seconds:
        run(chunk)
        steps += chunk
        elapsed = time.perf_counter() - start
    return num_envs * steps / elapsed


def device() -> str:
    libraries = ", ".join(f"{package} {version(package)}" for package in ("numba", "numpy", "minigrid"))
    cores = f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    return f"{cpu_name()}, {cores}; Python {platform.python_version()}, {libraries}"


def spread(values: list[float], unit: str) -> str:
    low, median, high = statistics.quantiles(values, n=4)
    return f"{median:>13,.0f} {unit}  ({low:,.0f} to {high:,.0f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=19)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--seconds", type=float, default=0.3, help="of each case in each repeat")
    options = parser.parse_args()

    minigrid = minigrid_stepper(options.size)
    ours = {case: our_stepper(*case, options.size) for case in CASES}
    minigrid(500)
    for (num_envs, *_), run in ours.items():
        run(max(200, 20_000 // num_envs))
    reference, speeds = [], {case: [] for case in CASES}
    for _ in range(options.repeats):
        reference.append(steps_per_second(minigrid, 1, options.seconds))
        for case, run in ours.items():
            speeds[case].append(steps_per_second(run, case[0], options.seconds))

    print(device())
    print(
        f"size {options.size}, graph c, random actions; warm-up 200 calls or more, {options.repeats} repeats of "
        f"{options.seconds} s; median (quartiles)"
    )
    print(f"{'MiniGrid':44}{spread(reference, 'steps/s')}")
    ratios = {}
    for case in CASES:
        ratios[case] = [a / b for a, b in zip(speeds[case], reference, strict=True)]
        title = f"{case[0]} environment{'s' * (case[0] > 1)}, {case[1]} thread{'s' * (case[1] > 1)}"
        title += ", remembering all" * bool(case[2])
        print(f"{title:44}{spread(speeds[case], 'steps/s')} {spread(ratios[case], 'x MiniGrid')}")
    for num_envs, floor in MIN_RATIOS.items():
        ratio = statistics.median(ratios[num_envs, 1, ()])
        what = f"{num_envs} environment{'s' * (num_envs > 1)} on one thread: {ratio:.0f} x MiniGrid"
        print(f"{what}, wanted {floor} x or more: {'met' if ratio >= floor else 'MISSED'}")


if __name__ == "__main__":
    main()
