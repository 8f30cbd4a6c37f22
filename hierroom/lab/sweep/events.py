"""What happens to the jobs of a sweep, wherever they are worked on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hierroom.lab.sweep.job import Job

MAX_TRIES = 3
"""How often a run is begun or gone on with whose process is killed or stopped."""


@dataclass(frozen=True)
class Progressed:
    """A job goes on: the steps trained so far, and a few words."""

    job: Job
    steps: int
    words: str


@dataclass(frozen=True)
class Finished:
    """A job is done: the results of its row."""

    job: Job
    numbers: Mapping[str, object]


@dataclass(frozen=True)
class Failed:
    """A job cannot be done: why."""

    job: Job
    reason: str


@dataclass(frozen=True)
class Retried:
    """The process that worked on a job was killed or stopped; it begins again where its last checkpoint is."""

    job: Job


@dataclass(frozen=True)
class Interrupted:
    """A job was stopped and saved, because the sweep is to stop."""

    job: Job


Event = Progressed | Finished | Failed | Retried | Interrupted
