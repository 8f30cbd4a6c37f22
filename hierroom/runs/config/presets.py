"""The configs from which training runs start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from hierroom.agents.config import AgentsConfig
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig, ships
from hierroom.worlds.make import find_task

_PAPER = TrainConfig(
    preset="paper",
    steps=10_000_000,
    num_envs=128,
    agents=AgentsConfig(features=("view-ids", "goal")),
    ppo=PPOConfig(
        sequence_length=128, learning_rate=2.5e-4, gamma=0.9, gae_lambda=0.95, value_weight=0.5, min_advantage_std=1e-8
    ),
)

PRESETS: Mapping[str, TrainConfig] = {
    "default": TrainConfig(),
    "long": TrainConfig(preset="long", steps=5_000_000, ppo=PPOConfig(final_learning_rate_fraction=0.1)),
    "large": TrainConfig(
        preset="large",
        env=EnvConfig(size=31),
        steps=3_000_000,
        num_envs=128,
        ppo=PPOConfig(
            sequence_length=64,
            learning_rate=2e-3,
            final_learning_rate_fraction=0.1,
            value_weight=0.5,
            gamma=0.98,
            gae_lambda=0.98,
        ),
    ),
    "learned": TrainConfig(
        preset="learned",
        env=EnvConfig(goal_mask="existing", subgoal_horizon=50),
        agents=AgentsConfig(
            meta="learned",
            features=("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        ),
        steps=3_000_000,
        num_envs=128,
        ppo=PPOConfig(final_learning_rate_fraction=0.1, value_weight=0.5, gamma=0.98),
    ),
    "task": TrainConfig(
        preset="task",
        num_envs=16,
        ppo=PPOConfig(
            sequence_length=64,
            minibatches=8,
            epochs=14,
            learning_rate=0.0015,
            entropy_weight=0.003,
            gamma=0.99,
            memory="none",
            scale_observations=True,
            scale_returns=True,
        ),
    ),
    "paper": _PAPER,
    "algorithm1": replace(
        _PAPER,
        preset="algorithm1",
        env=EnvConfig(goal_mask="existing"),
        agents=replace(_PAPER.agents, meta="learned", meta_features=("view-ids",), meta_start_success=0.0),
    ),
}
"""The presets by name, see `TrainConfig`. The default is the best config we know for any method in EscapeRooms, task is
for your own tasks; paper and algorithm1 have common values for what the paper leaves open. docs/presets.md says why."""


def find_preset(name: str) -> TrainConfig:
    """Return a preset: a config to train, or to change with `TrainConfig.changed`.

    Args:
        name: default, task, long, large, learned, paper or algorithm1.

    Examples:
        >>> hierroom.find_preset("long").steps
        5000000
    """
    if name not in PRESETS:
        raise InputError(f"preset must be one of {', '.join(PRESETS)}, not {name!r}")
    return PRESETS[name]


def preset_in_world(preset: str, env: EnvConfig) -> TrainConfig:
    """Return a preset with the task or the layouts of some environments, which decide other entries too."""
    return find_preset(preset).changed(**{name: one for name in ("task", "layout") if (one := getattr(env, name))})


def start_config(preset: str | None, entries: Mapping[str, Any]) -> TrainConfig:
    """Return the config that a run's entries change: a preset, by default the implied one.

    Its method is ppo if the entries name none and their task has no goals. So the task's module is imported.
    """
    start, task = find_preset(preset or implied_preset(entries)), entries.get("task")
    if "method" in entries or task is None or ships(task):
        return start
    found = find_task(task)
    return start if found is None or len(found.goal_set) else start.changed(method="ppo")


def implied_preset(entries: Mapping[str, Any]) -> str:
    """Return the preset of a run whose entries name none: those of ``learned`` were tuned for EscapeRooms."""
    task = entries.get("task")
    if task is not None and not ships(task):
        return "task"
    return "learned" if entries.get("meta") == "learned" and task is None else "default"
