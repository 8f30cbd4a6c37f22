"""Steps per second of training, and where the time goes, next to two other trainers in the same run.

    pip install -c constraints.txt -e '.[bench]'
    python -m benchmarks.train_speed

All train a flat PPO with an LSTM of 64 on graph c that reads the view: 128 environments x 128 steps, 4 epochs x 4
minibatches. sb3-contrib's RecurrentPPO runs on the same Gymnasium environment, one process, with the view flattened. It
has its own network (policy and value have an LSTM and two layers of 64 each), and once one shared LSTM and nothing
after it, like ours. PufferLib's trainer takes part if it is installed (see `benchmarks.puffer_trainer`). It steps our
vector environment as its native one. Its network is a layer of 64 and an LSTM of 64. The LSTM's state is reset at the
start of each rollout and not at the end of an episode; ours is reset at the end of an episode only.
HiPPO with 3 goals and with 13, with the features of the default, shows that the time does not grow with their number.
Repeats take turns, so that a busy machine slows all alike.
"""

from __future__ import annotations

import importlib.util
import os
import resource
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import gymnasium
import numpy as np
import torch
import tyro
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.vec_env import DummyVecEnv

import hierroom  # noqa: F401 - registers the environments
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import cpu_name
from hierroom.runs.trainer import Trainer
from hierroom.worlds.env_config import EnvConfig

NUM_ENVS, LENGTH, EPOCHS, MINIBATCHES = 128, 128, 4, 4
THEIRS = "sb3-contrib RecurrentPPO"


@dataclass(frozen=True)
class Options:
    """Time training."""

    repeats: int = 5
    """Updates of each that are timed, after one that is not."""
    threads: tuple[int, ...] = (1, 2)
    """Learner threads of ours to try."""


def ours(graph: str, threads: int, **settings: Any) -> tuple[Trainer, Counter[str]]:
    """Return a trainer on a graph, with some settings of its own, and the seconds spent so far by part."""
    ppo = PPOConfig(sequence_length=LENGTH, epochs=EPOCHS, minibatches=MINIBATCHES)
    config = TrainConfig(EnvConfig(graph), steps=10**9, num_envs=NUM_ENVS, threads=threads, ppo=ppo).changed(**settings)
    trainer = Trainer(config)
    agent = trainer.controller
    seconds: Counter[str] = Counter()
    for part, owner, name in (
        ("world", trainer.turns, "step"),
        ("features", agent.features, "encode"),
        ("policy", agent.learner, "act"),
        ("policy", agent.learner, "finish"),
        ("policy", agent.learner, "bootstrap"),
        ("update", agent.learner, "update"),
    ):
        object.__setattr__(owner, name, _timed(getattr(owner, name), part, seconds))  # some are frozen
    return trainer, seconds


def _timed(function: Callable, part: str, seconds: Counter[str]) -> Callable:
    def run(*arguments):
        started = time.perf_counter()
        result = function(*arguments)
        seconds[part] += time.perf_counter() - started
        return result

    return run


def theirs(**network) -> Callable[[], None]:
    """Return a function that trains sb3-contrib's RecurrentPPO for one update, with arguments for its network."""

    def make_env() -> gymnasium.Env:
        env = gymnasium.make("hierroom/EscapeRoom-c-v0")
        view = env.observation_space["observation"]
        space = gymnasium.spaces.Box(0.0, 10.0, (int(np.prod(view.shape)),), np.float32)
        return gymnasium.wrappers.TransformObservation(
            env, lambda o: o["observation"].ravel().astype(np.float32), space
        )

    model = RecurrentPPO(
        "MlpLstmPolicy",
        DummyVecEnv([make_env] * NUM_ENVS),
        n_steps=LENGTH,
        batch_size=NUM_ENVS * LENGTH // MINIBATCHES,
        n_epochs=EPOCHS,
        policy_kwargs={"lstm_hidden_size": 64, **network},
        seed=0,
        device="cpu",
    )
    return lambda: model.learn(NUM_ENVS * LENGTH, reset_num_timesteps=False) and None


def main() -> None:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    torch.set_num_threads(1)
    flat = {
        f"hierroom, {threads} threads": ours("c", threads, method="ppo", features=("view",))
        for threads in options.threads
    }
    star = str(Path(__file__).parent / "graphs" / "star.toml")
    goals = {f"hippo, {n} goals": ours(graph, 1) for n, graph in ((3, "a"), (13, star))}
    cases = {name: trainer.advance for name, (trainer, _) in (flat | goals).items()}
    cases[THEIRS] = theirs()
    cases[f"{THEIRS}, one LSTM"] = theirs(net_arch=[], shared_lstm=True, enable_critic_lstm=False)
    if importlib.util.find_spec("pufferlib"):
        from benchmarks.puffer_trainer import pufferlib_update

        cases["PufferLib 3.0"] = pufferlib_update("c", NUM_ENVS, LENGTH, EPOCHS, MINIBATCHES)
    speeds: dict[str, list[float]] = {name: [] for name in cases}
    for repeat in range(options.repeats + 1):
        for name, advance in cases.items():
            if repeat == 1 and name in flat:
                flat[name][1].clear()
            started = time.perf_counter()
            advance()
            if repeat:
                speeds[name].append(NUM_ENVS * LENGTH / (time.perf_counter() - started))
    print(f"{cpu_name()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    print(
        f"{NUM_ENVS} environments x {LENGTH} steps, {options.repeats} updates after one to warm up; median, quartiles"
    )
    reference = median(speeds[THEIRS])
    for name, values in speeds.items():
        low, middle, high = quantiles(values, n=4)
        print(f"{name:34} {middle:10,.0f} steps/s  ({low:,.0f} to {high:,.0f})  {middle / reference:6.1f} x")
    for name, (trainer, seconds) in flat.items():
        total = sum(NUM_ENVS * LENGTH / speed for speed in speeds[name])
        parts = {**seconds, "turns and the rest": total - seconds.total()}
        split = ", ".join(f"{part} {spent / total:.0%}" for part, spent in parts.items())
        rollout = trainer.controller.learner.n_rollout_bytes / 2**20
        print(f"{name}: {split}; rollout {rollout:.0f} MiB, which never grows")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    print(f"peak memory of the process, all of these together: {peak:.0f} MiB")


if __name__ == "__main__":
    main()
