"""Weights & Biases and MLflow as loggers, which need packages of their own."""

from __future__ import annotations

import importlib
import math
import os
import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hierroom.runs.logs.scalars import Plain
from hierroom.support.errors import InputError

_PARAMS_AT_ONCE = 100
"""So many a request to MLflow may have."""


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
            project=os.environ.get("WANDB_PROJECT", "hierroom"),
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


class MLflowLogger:
    """Shows a run in MLflow, at the place that ``MLFLOW_TRACKING_URI`` names, by default MLflow's own.

    Args:
        library: the package ``mlflow``.
        path: the run's folder, after which it is called.
        hyperparameters: what it is trained with.
        identity: of the run that an earlier session began; None: it is new.

    Attributes:
        identity: of the run.
    """

    label = "MLflow"

    def __init__(
        self, library: Any, path: Path, hyperparameters: Mapping[str, Plain], identity: str | None = None
    ) -> None:
        self._entities, self._client = library.entities, library.MlflowClient()
        if identity is None:
            name = os.environ.get("MLFLOW_EXPERIMENT_NAME", "hierroom")
            found = self._client.get_experiment_by_name(name)
            experiment = found.experiment_id if found is not None else self._client.create_experiment(name)
            identity = str(self._client.create_run(experiment, run_name=path.resolve().name).info.run_id)
            params = [library.entities.Param(name, str(value)) for name, value in hyperparameters.items()]
            for first in range(0, len(params), _PARAMS_AT_ONCE):
                self._client.log_batch(identity, params=params[first : first + _PARAMS_AT_ONCE])
        else:
            self._client.update_run(identity, status="RUNNING")
        self.identity = identity

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers; those that are not finite are left out, and names have only letters that MLflow allows."""
        now = int(1000 * time.time())
        metrics = [
            self._entities.Metric(re.sub(r"[^\w\-. /]", "_", name, flags=re.ASCII), float(value), now, steps)
            for name, value in scalars.items()
            if math.isfinite(value)
        ]
        self._client.log_batch(self.identity, metrics=metrics)

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show how the run ended; its hyperparameters are there already."""
        self.add({name: value for name, value in results.items() if "steps_to" in name}, steps)

    def sync(self) -> None:
        """Nothing: it keeps its own files."""

    def close(self, *, is_done: bool) -> None:
        """End a session."""
        self._client.set_terminated(self.identity, "FINISHED" if is_done else "KILLED")


LIBRARIES: Mapping[str, Callable[..., WandbLogger | MLflowLogger]] = {"wandb": WandbLogger, "mlflow": MLflowLogger}
"""The loggers by the name of their package, which nothing of hierroom requires."""


def load_library(name: str) -> Any:
    """Import the package of one of `LIBRARIES`."""
    try:
        library = importlib.import_module(name)
    except ImportError:
        library = None
    if getattr(library, "__file__", None) is None:  # such as a folder of that name, in which it once kept its files
        raise InputError(f"--log {name} needs the package {name}, which `pip install {name}` installs")
    return library
