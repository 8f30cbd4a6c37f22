"""Speed of a task's environments next to the same environments bare, in the same process and minute.

    python -m benchmarks.task_speed

16 environments, random actions, episodes that begin by themselves with seeds of their own. Each repeat times each case
once, one after another, in processor time, so that a busy machine slows them all: the ratios are more telling than the
speeds. "And asked" are the bare environments with every goal asked after each step, which no adapter can do without.
Floor: 90% of the bare environments' speed on MiniGrid. CartPole takes so little time that its goals alone cost more.

Then CartPole's own vector of 1,024 environments (`make_vec`). Floor: 80% of its speed with its goals asked.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np

import hierroom
from benchmarks.world_speed import device, spread
from hierroom import EnvConfig
from hierroom.worlds.make import make_world

NUM_ENVS, MIN_RATIO = 16, 0.9
OF_VECTOR, MIN_OF_VECTOR = 1024, 0.8


def has_key(env: Any, info: Any) -> bool:
    """Return whether the agent holds the key."""
    held = env.unwrapped.carrying
    return held is not None and held.type == "key"


def has_box(env: Any, info: Any) -> bool:
    """Return whether the agent holds the box."""
    held = env.unwrapped.carrying
    return held is not None and held.type == "box"


TASKS = {
    "UnlockPickup": hierroom.Task("MiniGrid-UnlockPickup-v0", {"key": has_key, "box": has_box}, target="box"),
    "CartPole": hierroom.Task(
        "CartPole-v1",
        {
            "right": lambda env, info: env.unwrapped.state[0] > 0.1,
            "left": lambda env, info: env.unwrapped.state[0] < -0.1,
        },
        target="left",
    ),
}


CARTPOLES = hierroom.Task(
    make_vec=lambda num_envs: gymnasium.make_vec(
        "CartPole-v1", num_envs=num_envs, vectorization_mode="vector_entry_point"
    ),
    goals={
        "right": lambda env, infos: env.unwrapped.state[0] > 0.1,
        "fallen": lambda env, infos: np.abs(env.unwrapped.state[2]) > env.unwrapped.theta_threshold_radians,
    },
    target="fallen",
)


def bare_vector(task: hierroom.Task, *, asks: bool) -> Callable[[int], None]:
    """Return a function that steps the task's own vector, and perhaps asks each goal."""
    env: Any = task.new_vector(OF_VECTOR)
    functions = (*task.goals.values(),) if asks else ()
    actions = [*np.random.default_rng(0).integers(task.n_actions, size=(64, OF_VECTOR))]
    env.reset(seed=0)

    def run(steps: int) -> None:
        for t in range(steps):
            *_, infos = env.step(actions[t % 64])
            for function in functions:
                function(env, infos)

    return run


def bare(task: hierroom.Task, *, asks: bool) -> Callable[[int], None]:
    """Return a function that steps the environments in a plain loop, and perhaps asks each goal."""
    envs = [task.new_env() for _ in range(NUM_ENVS)]
    functions = (*task.goals.values(),) if asks else ()
    actions = np.random.default_rng(0).integers(task.n_actions, size=(64, NUM_ENVS)).tolist()
    for seed, env in enumerate(envs):
        env.reset(seed=seed)
    next_seed = iter(range(NUM_ENVS, 10**9))

    def run(steps: int) -> None:
        for t in range(steps):
            for env, action in zip(envs, actions[t % 64], strict=True):
                _, _, terminated, truncated, info = env.step(action)
                for function in functions:
                    function(env, info)
                if terminated or truncated:
                    env.reset(seed=next(next_seed))

    return run


def as_world(task: hierroom.Task, num_envs: int = NUM_ENVS) -> Callable[[int], None]:
    """Return a function that steps them as a world and observes all."""
    world: Any = make_world(EnvConfig(task=task), num_envs, seed=0)
    actions = [*np.random.default_rng(0).integers(task.n_actions, size=(64, num_envs))]

    def run(steps: int) -> None:
        for t in range(steps):
            world.step(actions[t % 64])
            world.observe(world.everywhere)

    return run


def as_vector_env(task: hierroom.Task) -> Callable[[int], None]:
    """Return a function that steps Gymnasium's vector environment of the task."""
    rooms = gymnasium.make_vec("hierroom/Task-v0", num_envs=NUM_ENVS, task=task)
    rooms.reset(seed=0)
    actions = [*np.random.default_rng(0).integers(task.n_actions, size=(64, NUM_ENVS))]

    def run(steps: int) -> None:
        for t in range(steps):
            rooms.step(actions[t % 64])

    return run


def steps_per_second(run: Callable[[int], None], steps: int, num_envs: int = NUM_ENVS) -> float:
    """Return the speed of all environments together, in seconds of the processor."""
    start = time.process_time()
    run(steps)
    return num_envs * steps / (time.process_time() - start)


def compare(
    name: str, runs: dict[str, Callable[[int], None]], options: argparse.Namespace, num_envs: int
) -> dict[str, list[float]]:
    """Print the speeds of all cases, and return their ratios to the bare environments in each repeat."""
    for run in runs.values():
        run(100)
    speeds: dict[str, list[float]] = {case: [] for case in runs}
    for _ in range(options.repeats):
        for case, run in runs.items():
            speeds[case].append(steps_per_second(run, options.steps, num_envs))
    ratios = {case: [a / b for a, b in zip(found, speeds["bare"], strict=True)] for case, found in speeds.items()}
    for case, found in speeds.items():
        print(f"{name:13} {case:19}{spread(found, 'steps/s')}  {statistics.median(ratios[case]):.2f} x bare")
    return ratios


def main() -> None:
    """Print the speeds, and whether the floors are met."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--steps", type=int, default=288, help="of each environment, in each case and repeat")
    options = parser.parse_args()
    print(device())
    print(f"{NUM_ENVS} environments, {options.repeats} repeats of {options.steps} steps; median (quartiles)")
    for name, task in TASKS.items():
        runs = {
            "bare": bare(task, asks=False),
            "and asked": bare(task, asks=True),
            "world": as_world(task),
            "vector environment": as_vector_env(task),
        }
        ratios = compare(name, runs, options, NUM_ENVS)
        if name == "UnlockPickup":
            ratio = statistics.median(ratios["world"])
            print(f"at least {MIN_RATIO} x bare: {ratio:.2f}, {'met' if ratio >= MIN_RATIO else 'MISSED'}")
    cases = {"bare": bare_vector(CARTPOLES, asks=False), "and asked": bare_vector(CARTPOLES, asks=True)}
    ratios = compare("CartPoles", cases | {"world": as_world(CARTPOLES, OF_VECTOR)}, options, OF_VECTOR)
    ratio = statistics.median(a / b for a, b in zip(ratios["world"], ratios["and asked"], strict=True))
    print(f"at least {MIN_OF_VECTOR} x asked: {ratio:.2f}, {'met' if ratio >= MIN_OF_VECTOR else 'MISSED'}")


if __name__ == "__main__":
    main()
