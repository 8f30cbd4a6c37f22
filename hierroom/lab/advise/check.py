"""What a long run will meet, tried in a short one: spaces, networks, speeds, whether episodes and runs repeat."""

from __future__ import annotations

import hashlib
import time
from contextlib import closing

import numpy as np

from hierroom.agents.player import RandomPlayer
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import checkpoint
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.support.output import duration
from hierroom.worlds.actions import actions_in
from hierroom.worlds.make import make_world

SECONDS = 1.0
"""Time to measure a speed, after a first step or update, which loads kernels."""
FEW, COMPARED = 2, 200
"""Environments and steps that are played twice."""


def training_speed(config: TrainConfig) -> float:
    """Return the steps a second of training on this machine, without evaluations."""
    trainer = Trainer(config)
    with closing(trainer.turns.world):
        return _speed(trainer)


def _speed(trainer: Trainer) -> float:
    trainer.advance()
    steps, seconds = trainer.steps, trainer.seconds
    if seconds > SECONDS:  # a slow task
        return trainer.steps_per_second
    while trainer.seconds - seconds < SECONDS:
        trainer.advance()
    return (trainer.steps - steps) / (trainer.seconds - seconds)


def check(config: TrainConfig) -> dict[str, str]:
    """Return what a user wants to know before a long run of a config, by name."""
    trainer = Trainer(config)
    with closing(trainer.turns.world) as world:
        spaces = [f"{name} {one.dtype} {[*(one.shape or ())]}" for name, one in world.observation_spaces.items()]
        rows = {"observations": ", ".join(spaces), "actions": str(actions_in(world).new_space())}
        rows["goals"] = ", ".join(world.goals.names) or "none"
        for name, agent in trainer.agents.items():
            meta = config.resolved_method.meta
            rows[name] = f"script {meta}" if meta != "none" else "none"
            if isinstance(agent, PPOAgent):
                size = sum(one.numel() for one in agent.learner.network.parameters())
                rows[name] = f"{size:,} weights, reads {', '.join(agent.features.names)}"
        training = _speed(trainer)
    rows["bare speed"] = f"{_bare_speed(config):,.0f} steps a second in {config.num_envs} environments"
    rows["training"] = f"{training:,.0f} steps a second, {duration(1e6 / training)} a million"
    rows["episodes"] = (
        "repeat" if _played(config) == _played(config) else "do not repeat: equal seeds and actions gave other results"
    )
    rows["resume"] = "exact" if (why := _not_resumed(config)) is None else f"not exact: {why}"
    return rows


def _bare_speed(config: TrainConfig) -> float:
    with closing(make_world(config.env, config.num_envs, seed=0)) as world:
        player = RandomPlayer(np.random.default_rng(0))
        world.step(player.actions(world))
        steps, started = 0, time.perf_counter()
        while (spent := time.perf_counter() - started) < SECONDS:
            world.step(player.actions(world))
            steps += len(world)
        return steps / spent


def _played(config: TrainConfig) -> str:
    """Return a digest of what random actions lead to in a few environments."""
    digest, player = hashlib.sha256(), RandomPlayer(np.random.default_rng(0))
    with closing(make_world(config.env, FEW, seed=0)) as world:
        for _ in range(COMPARED):
            outcome, shown = world.step(player.actions(world)), world.observe(world.everywhere).as_dict()
            digest.update(outcome.tobytes() + b"".join(shown[name].tobytes() for name in sorted(shown)))
    return digest.hexdigest()


def _not_resumed(config: TrainConfig) -> str | None:
    """Return why a run that goes on from a checkpoint differs from one that was never stopped; None if it does not."""
    first, second = Trainer(config), Trainer(config)
    with closing(first.turns.world), closing(second.turns.world):
        first.advance()
        notes = len(second.turns.world.notes)
        try:
            second.load_state_dict(checkpoint.from_bytes(checkpoint.to_bytes(first.state_dict())))
        except InputError as error:
            return str(error)
        if len(second.turns.world.notes) > notes:
            return second.turns.world.notes[-1]
        states = []
        for trainer in (first, second):
            trainer.advance()
            states.append(checkpoint.to_bytes(trainer.state_dict() | {"seconds": 0.0, "compile_seconds": 0.0}))
        return None if states[0] == states[1] else "a resumed run went another way"
