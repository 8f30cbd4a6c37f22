"""Weights & Biases and MLflow as loggers, which need extra packages."""

from __future__ import annotations

import importlib
import math
import os
import re
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.runs.logs.scalars import Logger, Plain
from hierroom.support.errors import InputError

_PARAMS_AT_ONCE = 100
"""The most parameters that a request to MLflow may have."""


class _Wandb(Logger):
    """Shows a run in Weights & Biases over the steps trained; with ``WANDB_MODE=offline`` it uses no network."""

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
            settings=library.Settings(console="off"),  # W&B must not capture printed lines
        )
        self.identity: str = self._run.id
        self._run.define_metric("steps")
        self._run.define_metric("*", step_metric="steps")

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        self._run.log({**{name: value for name, value in scalars.items() if math.isfinite(value)}, "steps": steps})

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        self._run.summary.update({**results, "steps": steps})

    def close(self, *, is_done: bool) -> None:
        self._run.finish(exit_code=0 if is_done else 130)  # 130: stopped, may be resumed


class _MLflow(Logger):
    """Shows a run in MLflow, on the server or in the folder of ``MLFLOW_TRACKING_URI``, by default MLflow's own."""

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
        now = int(1000 * time.time())
        metrics = [
            self._entities.Metric(re.sub(r"[^\w\-. /]", "_", name, flags=re.ASCII), float(value), now, steps)
            for name, value in scalars.items()
            if math.isfinite(value)
        ]
        self._client.log_batch(self.identity, metrics=metrics)

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        self.add({name: value for name, value in results.items() if "steps_to" in name}, steps)

    def close(self, *, is_done: bool) -> None:
        self._client.set_terminated(self.identity, "FINISHED" if is_done else "KILLED")


LIBRARIES: Mapping[str, type[_Wandb | _MLflow]] = {"wandb": _Wandb, "mlflow": _MLflow}
"""The loggers by the name of their package, which is an optional dependency.

Each takes the package, the run's folder, its hyperparameters, and its ``identity`` in an earlier session, if any.
"""


def load_library(name: str) -> Any:
    """Import the package of one of `LIBRARIES`."""
    try:
        library = importlib.import_module(name)
    except ImportError:
        library = None
    if getattr(library, "__file__", None) is None:  # a folder of that name, such as one with its old files
        raise InputError(f"--log {name} needs the package {name}, which `pip install {name}` installs")
    return library
