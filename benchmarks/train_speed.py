"""Steps per second of training, and where the time goes, beside sb3-contrib's RecurrentPPO in the same run.

    pip install -c constraints.txt -e '.[bench]'
    python benchmarks/train_speed.py

Both train a flat PPO with an LSTM of 64 on graph c: 128 rooms x 128 steps, 4 epochs x 4 minibatches. Theirs runs on the
same Gymnasium room, one process, with the view flattened. Repeats take turns, so that a busy machine slows both.
"""

from __future__ import annotations

import os
import platform
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median, quantiles

import gymnasium
import numpy as np
import torch
import tyro
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.vec_env import DummyVecEnv

import hierroom  # noqa: F401 - registers the rooms
from hierroom.learners import PPOConfig
from hierroom.presets import TrainConfig
from hierroom.trainer import Trainer

ROOMS, LENGTH, EPOCHS, MINIBATCHES = 128, 128, 4, 4


@dataclass(frozen=True)
class Options:
    """Time training."""

    repeats: int = 5
    """Updates of each that are timed, after one that is not."""
    threads: tuple[int, ...] = (1, 2)
    """Learner threads of ours to try."""


def ours(threads: int) -> tuple[Callable[[], None], Counter[str]]:
    """A function that trains for one update, and the seconds spent so far by part."""
    ppo = PPOConfig(sequence_length=LENGTH, epochs=EPOCHS, minibatches=MINIBATCHES)
    trainer = Trainer(replace(TrainConfig(), method="ppo", steps=10**9, rooms=ROOMS, threads=threads, ppo=ppo))
    seconds: Counter[str] = Counter()
    for part, owner, name in (
        ("world and turns", trainer.turns, "step"),
        ("policy", trainer.learner, "act"),
        ("policy", trainer.learner, "finish"),
        ("update", trainer.learner, "update"),
    ):
        setattr(owner, name, _timed(getattr(owner, name), part, seconds))
    return trainer.advance, seconds


def _timed(function: Callable, part: str, seconds: Counter[str]) -> Callable:
    def run(*arguments):
        started = time.perf_counter()
        result = function(*arguments)
        seconds[part] += time.perf_counter() - started
        return result

    return run


def theirs() -> Callable[[], None]:
    """A function that trains sb3-contrib's RecurrentPPO for one update."""

    def room() -> gymnasium.Env:
        env = gymnasium.make("hierroom/EscapeRoom-c-v0")
        view = env.observation_space["observation"]
        space = gymnasium.spaces.Box(0.0, 10.0, (int(np.prod(view.shape)),), np.float32)
        return gymnasium.wrappers.TransformObservation(
            env, lambda o: o["observation"].ravel().astype(np.float32), space
        )

    model = RecurrentPPO(
        "MlpLstmPolicy",
        DummyVecEnv([room] * ROOMS),
        n_steps=LENGTH,
        batch_size=ROOMS * LENGTH // MINIBATCHES,
        n_epochs=EPOCHS,
        policy_kwargs={"lstm_hidden_size": 64, "net_arch": [], "shared_lstm": True, "enable_critic_lstm": False},
        seed=0,
        device="cpu",
    )
    return lambda: model.learn(ROOMS * LENGTH, reset_num_timesteps=False) and None


def main() -> None:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    torch.set_num_threads(1)
    own = {threads: ours(threads) for threads in options.threads}
    cases = {f"hierroom, {threads} threads": advance for threads, (advance, _) in own.items()}
    cases["sb3-contrib RecurrentPPO"] = theirs()
    speeds: dict[str, list[float]] = {name: [] for name in cases}
    for repeat in range(options.repeats + 1):
        for name, advance in cases.items():
            if repeat == 1 and name.startswith("hierroom"):
                own[int(name.split()[1])][1].clear()
            started = time.perf_counter()
            advance()
            if repeat:
                speeds[name].append(ROOMS * LENGTH / (time.perf_counter() - started))
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    print(f"{ROOMS} rooms x {LENGTH} steps, warm-up 1 update, {options.repeats} timed; median (quartiles) steps/s")
    reference = median(speeds["sb3-contrib RecurrentPPO"])
    for name, values in speeds.items():
        low, middle, high = quantiles(values, n=4)
        print(f"{name:26} {middle:10,.0f}  ({low:,.0f} to {high:,.0f})  {middle / reference:6.1f} x")
    for threads, (_, seconds) in own.items():
        total = options.repeats * ROOMS * LENGTH / median(speeds[f"hierroom, {threads} threads"])
        parts = dict(seconds) | {"inputs and the rest": max(total - seconds.total(), 0.0)}
        split = ", ".join(f"{part} {spent / sum(parts.values()):.0%}" for part, spent in parts.items())
        print(f"{threads} threads: {split}")


if __name__ == "__main__":
    main()
