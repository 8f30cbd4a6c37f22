"""Speed of a task's environments next to the same environments bare, in the same process and minute.

    python -m benchmarks.task_speed

16 environments, random actions, episodes that begin by themselves with seeds of their own. Each repeat times each case
once, one after another, in processor time, so that a busy machine slows them all: the ratios are more telling than the
speeds. "And asked" are the bare environments with every goal asked after each step, which no adapter can do without.
Floor: 90% of the bare environments' speed on MiniGrid. CartPole takes so little time that its goals alone cost more.

Then CartPole's own vector of 1,024 environments (`make_vec`). Floor: 80% of its speed with its goals asked.

At the end training next to Stable-Baselines3's PPO with the same network, epochs and minibatches: from frames of
84 x 84 x 3 with Nature's network (floor: as fast in seconds of the processor), and from CartPoles (2 times).
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
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


class Frames(gymnasium.Env):
    """Shows a square, left or right; the action names its side."""

    observation_space = gymnasium.spaces.Box(0, 255, (84, 84, 3), np.uint8)
    action_space = gymnasium.spaces.Discrete(2)

    def _draw(self) -> np.ndarray:
        self.side, row = (int(self.np_random.integers(n)) for n in (2, 72))
        frame = np.zeros((84, 84, 3), np.uint8)
        frame[row : row + 12, 10 + 50 * self.side : 22 + 50 * self.side] = 200
        return frame

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict]:
        """Begin an episode of 50 frames."""
        super().reset(seed=seed)
        self.left = 50
        return self._draw(), {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Reward the side of the frame, and show the next one."""
        reward, self.left = float(action == self.side), self.left - 1
        return self._draw(), reward, self.left == 0, False, {}


FRAMES = hierroom.Task(Frames)


@dataclass(frozen=True)
class Training:
    """Hold a case of training: one update of each side collects ``num_envs`` times ``horizon`` steps.

    Args:
        task: the task of ours.
        make: returns an environment of theirs.
        policy: theirs, with the network of ours.
        num_envs: environments of both.
        horizon: steps of each environment before an update.
        epochs: epochs of both.
        batch: steps of a minibatch of both.
        entries: entries of our config.
        floor: our steps per CPU second over theirs.
    """

    task: hierroom.Task
    make: Callable[[], gymnasium.Env]
    policy: str
    num_envs: int
    horizon: int
    epochs: int
    batch: int
    entries: Mapping[str, Any]
    floor: float

    def updates(self, threads: int) -> dict[str, Callable[[], object]]:
        """Return functions that train for one more update: ours and Stable-Baselines3's."""
        import torch
        from stable_baselines3 import PPO
        from stable_baselines3.common.vec_env import DummyVecEnv

        from hierroom.runs.config.presets import find_preset
        from hierroom.runs.trainer import Trainer

        torch.set_num_threads(threads)
        steps = self.num_envs * self.horizon
        sizes = {"num_envs": self.num_envs, "sequence_length": self.horizon, "minibatches": steps // self.batch}
        entries = {**sizes, "epochs": self.epochs, **self.entries}
        trainer = Trainer(find_preset("task").changed(task=self.task, method="ppo", **entries))
        settings = {"n_steps": self.horizon, "batch_size": self.batch, "n_epochs": self.epochs, "device": "cpu"}
        model = PPO(self.policy, DummyVecEnv([self.make] * self.num_envs), seed=0, **settings)
        return {"ours": trainer.advance, "theirs": lambda: model.learn(steps, reset_num_timesteps=False)}


make_cartpole = partial(gymnasium.make, "CartPole-v1")
CARTPOLE = hierroom.Task(make_cartpole)
VECTOR = replace(CARTPOLES, goals={}, target=None)
TRAININGS = {
    "frames": Training(FRAMES, Frames, "CnnPolicy", 8, 32, 4, 64, {"pictures": "nature"}, 1.0),
    "8 CartPoles": Training(CARTPOLE, make_cartpole, "MlpPolicy", 8, 128, 4, 256, {}, 2.0),
    "64 CartPoles": Training(CARTPOLE, make_cartpole, "MlpPolicy", 64, 128, 4, 2048, {}, 2.0),
    "their vector": Training(VECTOR, make_cartpole, "MlpPolicy", 64, 128, 4, 2048, {}, 2.0),
    "8 by default": Training(CARTPOLE, make_cartpole, "MlpPolicy", 8, 128, 10, 64, {}, 2.0),
    "64 by default": Training(CARTPOLE, make_cartpole, "MlpPolicy", 64, 128, 10, 64, {}, 2.0),
}
"""By default: Stable-Baselines3's epochs and minibatches. Their vector: of ours alone, as theirs takes no vector."""


def compare_training(name: str, repeats: int, threads: int) -> None:
    """Print both speeds of training, in seconds of the processor and of the clock, with some of torch's threads."""
    case, speeds = TRAININGS[name], {}
    steps = case.num_envs * case.horizon
    updates = case.updates(threads)
    for repeat in range(repeats + 1):
        for side, update in updates.items():
            start = time.process_time(), time.perf_counter()
            update()
            if repeat:
                spent = time.process_time() - start[0], time.perf_counter() - start[1]
                speeds.setdefault(side, []).append((steps / spent[0], steps / spent[1]))
    for n, what in enumerate(("CPU second", "second")):
        ours, theirs = ([one[n] for one in speeds[side]] for side in ("ours", "theirs"))
        ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
        low, ratio, high = np.quantile(ratios, (0.25, 0.5, 0.75))
        found = f"{statistics.median(ours):,.0f} for {statistics.median(theirs):,.0f} steps a {what}"
        print(f"{name:13} {found}: {ratio:.2f} ({low:.2f}-{high:.2f}) x Stable-Baselines3")
        if not n:
            print(f"at least {case.floor} x: {ratio:.2f}, {'met' if ratio >= case.floor else 'MISSED'}")


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
    parser.add_argument("--only-training", choices=TRAININGS, nargs="*", help="only training, of these tasks or all")
    parser.add_argument("--threads", type=int, default=2, help="torch's threads in training")
    options = parser.parse_args()
    print(device())
    if options.only_training is not None:
        for name in options.only_training or TRAININGS:
            compare_training(name, options.repeats, options.threads)
        return
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
    for name in TRAININGS:
        compare_training(name, options.repeats, options.threads)


if __name__ == "__main__":
    main()
