"""Decisions that a run makes once, from a trial of a user's environment, about what its config leaves open."""

from __future__ import annotations

from typing import cast

from hierroom.agents.playback import MOST_IN_GIF
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.results import N_PICTURED
from hierroom.support.errors import InputError
from hierroom.support.output import warn
from hierroom.worlds.make import find_task
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.task import Task
from hierroom.worlds.task.trial import picture_seconds

MOST_SECONDS, MOST_SHARE = 10.0, 0.1
"""A film may take so many seconds, or such a share of the time that the environments take, whichever is longer."""


def decide(config: TrainConfig) -> TrainConfig:
    """Return the config of a new run, with its open entries decided if its task is the user's; say what it leaves out.

    The config is saved with the decisions, so a resumed run does the same.
    """
    task = find_task(config.env.task)
    if not isinstance(task, Task) or config.film is not None:
        return config
    limit, step = config.env.max_steps or task.max_steps, task.trial.step_seconds
    try:
        seconds = (N_PICTURED + 1) * limit * step + min(limit, MOST_IN_GIF) * picture_seconds(cast(TaskParts, task))
    except InputError as error:
        task.replayer.no_picture = str(error)
        warn(f"there is no film of an episode: {error}")
        return config.changed(film=False)
    if seconds <= max(MOST_SECONDS, MOST_SHARE * config.steps * step):
        return config.changed(film=True)
    warn(f"there is no film of an episode, which may take {seconds:,.0f} seconds; --film True writes one")
    return config.changed(film=False)
