"""Speed of training on a task next to Stable-Baselines3's PPO with the same network, epochs and minibatches.

    python -m benchmarks.task_training --threads 1
    python -m benchmarks.task_training --only frames

Frames are 84 x 84 x 3, with Nature's network. Floors, in steps per second of the processor: as fast from frames, twice
as fast from CartPoles. Each repeat times both sides once, so that a busy machine slows them both.
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
import numpy as np

import hierroom
from benchmarks.task_speed import CARTPOLES
from benchmarks.world_speed import device


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


def main() -> None:
    """Print the speeds, and whether the floors are met."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=TRAININGS, nargs="+", default=[*TRAININGS])
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2, help="torch's threads")
    options = parser.parse_args()
    print(device())
    for name in options.only:
        compare_training(name, options.repeats, options.threads)


if __name__ == "__main__":
    main()
