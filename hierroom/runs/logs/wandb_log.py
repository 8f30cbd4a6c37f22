"""Weights & Biases as a logger, which needs the package wandb."""

from __future__ import annotations

import importlib
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.runs.logs.scalars import Logger, Plain
from hierroom.support.errors import InputError
from hierroom.support.files import to_json, write_atomically
from hierroom.support.reading import read_json

_FILE = "logs.json"
"""The file with the run's id, by which a later session continues the same run."""


class WandbLog(Logger):
    """Shows a run in Weights & Biases over the steps trained; with ``WANDB_MODE=offline`` it uses no network."""

    label = "Weights & Biases"

    def __init__(self, path: Path, hyperparameters: Mapping[str, Plain]) -> None:
        library = wandb_package()
        self._run = library.init(
            project=os.environ.get("WANDB_PROJECT", "hierroom"),
            name=path.resolve().name,
            id=_identity(path),
            resume="allow",
            config=dict(hyperparameters),
            dir=str(path),
            settings=library.Settings(console="off"),  # W&B must not capture printed lines
        )
        self._run.define_metric("steps")
        self._run.define_metric("*", step_metric="steps")
        write_atomically(path / _FILE, to_json({"wandb": self._run.id}))

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers."""
        self._run.log({**{name: value for name, value in scalars.items() if math.isfinite(value)}, "steps": steps})

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show results in the summary of the run."""
        self._run.summary.update({**results, "steps": steps})

    def close(self, *, is_done: bool) -> None:
        """End a session."""
        self._run.finish(exit_code=0 if is_done else 130)  # 130: stopped, may be resumed


def wandb_package() -> Any:
    """Import the package wandb."""
    try:
        library = importlib.import_module("wandb")
    except ImportError:
        library = None
    if getattr(library, "__file__", None) is None:  # a folder of that name, in which it keeps its files
        raise InputError("--log wandb needs the package wandb, which `pip install wandb` installs")
    return library


def _identity(path: Path) -> str | None:
    try:
        identity = read_json(path / _FILE)["wandb"]
    except (InputError, TypeError, KeyError):
        return None
    return identity if isinstance(identity, str) else None
