"""What happens to the jobs of a sweep, wherever they are worked on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hierroom.lab.sweep.job import Job

MAX_TRIES = 3
"""How often a run is begun or resumed where its process is killed or stopped."""


@dataclass(frozen=True)
class Event:
    """What happened to a job."""

    job: Job


@dataclass(frozen=True)
class Progressed(Event):
    """It goes on: the steps trained so far, and a few words."""

    steps: int
    words: str


@dataclass(frozen=True)
class Finished(Event):
    """It is done: the results of its row."""

    numbers: Mapping[str, object]


@dataclass(frozen=True)
class Failed(Event):
    """It cannot be done: why."""

    reason: str


class Retried(Event):
    """The process that worked on it was killed or stopped; it begins again where its last checkpoint is."""


class Interrupted(Event):
    """It was stopped and saved, because the sweep is to stop."""
