"""Decide once for a user's task, from the speed of its environment: a film, and the steps of evaluations."""

from __future__ import annotations

import math
import os
from typing import Any

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import find_preset
from hierroom.runs.results import N_PICTURED
from hierroom.runs.trainer import MOST_EPISODES
from hierroom.support.output import duration, warn
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS
from hierroom.worlds.make import find_task
from hierroom.worlds.task.task import Task

MOST_SECONDS, MOST_SHARE = 10.0, 0.1
"""A film may take so many seconds, or such a share of the time that the environments take, whichever is longer."""
EVALUATION_SHARE = 0.07
"""The steps of evaluations in a run may take such a share of its time, which their resets and small batches make 10 to
15%; those of a sweep at its end half as much in addition."""
LEARNING_SECONDS, PLAYING_SECONDS = 150e-6, 40e-6
"""Seconds of a step beside its environment in training and in evaluations, roughly: preset ``task`` on vectors."""


def decide(config: TrainConfig) -> TrainConfig:
    """Return the config of a new run, with its open entries decided if its task is the user's; say what it leaves out.

    The config is saved with the decisions, so a resumed run does the same.
    """
    task = find_task(config.env.task)
    if not isinstance(task, Task):
        return config
    limit, step = config.env.max_steps or task.max_steps, step_seconds(task)
    changes: dict[str, Any] = {} if config.film is not None else {"film": _may_film(config, task, limit)}
    is_asked = config.evaluation_episodes or config.evaluations != find_preset(config.preset).evaluations
    if not is_asked and config.evaluation_steps is None:
        worth = EVALUATION_SHARE / (1 - EVALUATION_SHARE) * (step + LEARNING_SECONDS) / (step + PLAYING_SECONDS)
        if (most := int(worth * config.steps)) < (config.evaluations + 1) * MOST_EPISODES * limit:
            changes["evaluation_steps"] = max(most, 1)
            warn(
                f"evaluations take at most {most:,} steps, about a tenth of the time, by fewer episodes "
                "or later ones; --evaluation-episodes N plays N in each"
            )
    return config.changed(**changes) if changes else config


def _may_film(config: TrainConfig, task: Task, limit: int) -> bool:
    step = task.trial.step_seconds
    seconds = (N_PICTURED + 1) * limit * step
    if task.make_vec is None and seconds <= max(MOST_SECONDS, MOST_SHARE * config.steps * step):
        return True
    why = f"it may take {seconds:,.0f} seconds; --film True writes one"
    warn(f"there is no film of an episode: {why if task.make_vec is None else 'a vector replays none'}")
    return False


def step_seconds(task: Task) -> float:
    """Return how long an environment's step takes, where several processes share the work."""
    return task.trial.step_seconds / max(1, min(task.processes, os.cpu_count() or 1))


def speed_in_words(config: TrainConfig, steps: int) -> str:
    """Return the speed of a user's environment, and how long the rest of a run takes after some steps; else nothing."""
    task = find_task(config.env.task)
    if not isinstance(task, Task):
        return ""
    step = step_seconds(task)
    left = max(config.steps - steps, 0) * (step + LEARNING_SECONDS)
    return f"; its environments take {1 / step:,.0f} steps/s, so training about {duration(left)}"


def episodes_now(config: TrainConfig, used: float, left: int, length: float) -> int | None:
    """Return how many episodes the next evaluation plays; 0: none, None: as the config says.

    Args:
        config: a config; its ``evaluation_steps`` are shared among the evaluations that are left.
        used: steps that evaluations have taken.
        left: number of evaluations that are left, with this one; the last one plays at least one episode.
        length: mean length of the latest episodes of training; NaN before a few have ended, which counts as the limit.
    """
    if config.evaluation_steps is None:
        return None
    if math.isnan(length):
        task = find_task(config.env.task)
        length = config.env.max_steps or (DEFAULT_MAX_STEPS if task is None else task.max_steps)
    episodes = int((config.evaluation_steps - used) / left / length)
    return None if episodes >= MOST_EPISODES else max(episodes, int(left == 1))
