"""Weights & Biases as a `Logger`."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.runs.logs.logger import Plain

PROJECT = "hierroom"
"""The project where ``WANDB_PROJECT`` names none."""


class WandbLogger:
    """Shows a run in Weights & Biases, as the user's own settings of it say: ``WANDB_MODE=offline`` asks no network.

    Numbers are drawn over the steps trained, so what a resumed run shows again stands where it stood.

    Args:
        library: the package ``wandb``.
        path: the run's folder, after which it is called, and in which Weights & Biases keeps its files.
        hyperparameters: what it is trained with.
        identity: of the run that an earlier session began; None: it is new.

    Attributes:
        identity: of the run.
    """

    label = "Weights & Biases"

    def __init__(
        self, library: Any, path: Path, hyperparameters: Mapping[str, Plain], identity: str | None = None
    ) -> None:
        self._run = library.init(
            project=os.environ.get("WANDB_PROJECT", PROJECT),
            name=path.resolve().name,
            id=identity,
            resume="allow",
            config=dict(hyperparameters),
            dir=str(path),
            settings=library.Settings(console="off"),  # what is printed stays what the run prints
        )
        self.identity: str = self._run.id
        self._run.define_metric("steps")
        self._run.define_metric("*", step_metric="steps")

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers; those that are not finite are left out."""
        self._run.log({**{name: value for name, value in scalars.items() if math.isfinite(value)}, "steps": steps})

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show how the run ended in the table of runs, beside what it was trained with."""
        self._run.summary.update({**results, "steps": steps})

    def sync(self) -> None:
        """Nothing: it keeps its own files."""

    def close(self, *, is_done: bool) -> None:
        """End a session; a run that may be resumed ends as one that was stopped."""
        self._run.finish(exit_code=0 if is_done else 130)
