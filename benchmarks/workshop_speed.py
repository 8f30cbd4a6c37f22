"""Steps per second of the Workshop and of the EscapeRoom, in the same process and minute.

    python -m benchmarks.workshop_speed

Random actions, 128 environments on one thread, a fresh observation from every step, episodes that begin by themselves.
Each repeat times each case once, one after another, so that a busy machine slows them all: the ratios are more telling
than the speeds. Floors: 2 million steps a second in the fastest repeat, and half the speed of the EscapeRoom.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.world_speed import device, spread, steps_per_second
from hierroom import EnvConfig
from hierroom.worlds.make import make_world

NUM_ENVS = 128
ESCAPE_ROOM = EnvConfig(graph="c")
WORKSHOPS = ("workshop:6", "workshop:12", "workshop:24")
MIN_SPEED, MIN_RATIO = 2_000_000, 0.5


def stepper(config: EnvConfig) -> Callable[[int], None]:
    """Return a function that takes some steps in every environment and looks at each."""
    world: Any = make_world(config, NUM_ENVS, seed=0)
    actions = list(np.random.default_rng(0).integers(world.n_actions, size=(64, NUM_ENVS)))

    def run(steps: int) -> None:
        for t in range(steps):
            world.step(actions[t % 64])
            world.observe(world.everywhere).as_dict()

    return run


def main() -> None:
    """Print the speeds and whether the floors are met."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--seconds", type=float, default=0.3, help="of each case in each repeat")
    options = parser.parse_args()
    configs = {"EscapeRoom, graph c": ESCAPE_ROOM, **{name: EnvConfig(task=name) for name in WORKSHOPS}}
    runs = {name: stepper(config) for name, config in configs.items()}
    for run in runs.values():
        run(500)
    speeds: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(options.repeats):
        for name, run in runs.items():
            speeds[name].append(steps_per_second(run, NUM_ENVS, options.seconds))

    print(device())
    print(f"{NUM_ENVS} environments, one thread, {options.repeats} repeats of {options.seconds} s; median (quartiles)")
    room, *_ = speeds.values()
    ratios = {name: [a / b for a, b in zip(found, room, strict=True)] for name, found in speeds.items()}
    for name, found in speeds.items():
        print(f"{name:22}{spread(found, 'steps/s')}  {statistics.median(ratios[name]):.2f} x EscapeRoom")
    fastest, ratio = max(speeds[WORKSHOPS[0]]), statistics.median(ratios[WORKSHOPS[0]])
    print(f"at least {MIN_SPEED:,} steps/s: {fastest:,.0f}, {'met' if fastest >= MIN_SPEED else 'MISSED'}")
    print(f"at least {MIN_RATIO} x EscapeRoom: {ratio:.2f}, {'met' if ratio >= MIN_RATIO else 'MISSED'}")


if __name__ == "__main__":
    main()
