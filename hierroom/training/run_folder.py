"""The folder of a training run: config, metrics, checkpoints and summary. Every file is written atomically."""

from __future__ import annotations

import csv
import io
import json
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch

from hierroom.errors import InputError
from hierroom.files import to_json, write_atomically
from hierroom.training.config import TrainConfig

CHECKPOINT_FORMAT = 5


class RunFolder:
    """A training run on disk.

    The folder contains ``config.json``, ``versions.json`` (the package versions at the start), ``metrics.csv`` (a row
    for each time that training is logged), ``checkpoints/`` (named by their steps), ``summary.json``, TensorBoard
    events and pictures. ``config.json`` holds goal graphs of one's own by their content, so that the run can continue
    even if their files change.

    Args:
        path: the folder.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)

    @classmethod
    def create(cls, path: str | Path, config: TrainConfig) -> RunFolder:
        """Create the folder of a new run.

        Args:
            path: the folder, new or empty.
            config: config of the run.

        Raises:
            InputError: if the folder is not empty or cannot be created.
        """
        run = cls(path)
        try:
            if run.path.exists() and any(run.path.iterdir()):
                raise FileExistsError
            run.checkpoints.mkdir(parents=True)
        except (FileExistsError, NotADirectoryError):
            raise InputError(f"{run.path} is not an empty folder; choose another --out, or --resume it") from None
        except OSError as error:
            raise InputError(f"cannot create the run folder {run.path}: {error.strerror}") from error
        versions = {package: version(package) for package in ("hierroom", "numba", "numpy", "torch")}
        write_atomically(
            run.path / "versions.json", to_json({"python": platform.python_version(), **versions}).encode()
        )
        run.save_config(config)
        return run

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Open the folder of an existing run.

        Raises:
            InputError: if there is no run.
        """
        run = cls(path)
        if not (run.path / "config.json").is_file():
            raise InputError(f"{run.path} is not a run folder: it has no config.json")
        return run

    @property
    def checkpoints(self) -> Path:
        """The folder of the checkpoints."""
        return self.path / "checkpoints"

    def save_config(self, config: TrainConfig) -> None:
        """Write config.json."""
        write_atomically(self.path / "config.json", to_json(config.to_dict()).encode())

    def config(self) -> TrainConfig:
        """Read the config of the run.

        Raises:
            InputError: if config.json is broken.
        """
        path = self.path / "config.json"
        try:
            return TrainConfig.from_dict(json.loads(path.read_text()))
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        except (OSError, ValueError) as error:
            raise InputError(f"cannot read {path}: {error}") from error

    def save_checkpoint(self, state: Mapping[str, Any]) -> Path:
        """Write a checkpoint, named by its steps, from the result of `Trainer.state_dict`."""
        buffer = io.BytesIO()
        torch.save({"format": CHECKPOINT_FORMAT, **state}, buffer)
        path = self.checkpoints / f"{state['steps']:012d}.pt"
        write_atomically(path, buffer.getvalue())
        return path

    def load_checkpoint(self, steps: int | None = None) -> dict[str, Any]:
        """Read the checkpoint after ``steps`` steps, by default the newest; no code from the file is executed.

        Raises:
            InputError: if there is none, it is broken, or another version of hierroom wrote it in another format.
        """
        paths = {int(path.stem): path for path in sorted(self.checkpoints.glob("*.pt")) if path.stem.isdigit()}
        if not paths:
            raise InputError(f"{self.path} has no checkpoint in {self.checkpoints.name}/")
        if steps is not None and steps not in paths:
            raise InputError(f"{self.path} has checkpoints after {', '.join(map(str, paths))} steps, not {steps}")
        path = paths[max(paths) if steps is None else steps]
        try:
            state = torch.load(path, map_location="cpu", weights_only=True)
        except Exception as error:  # torch raises many types for a broken file, RuntimeError among them
            lines = str(error).strip().splitlines() or [type(error).__name__]
            reason = lines[0].split(". ")[0]  # the rest is advice to users of torch
            raise InputError(f"cannot read the checkpoint {path}: {reason}") from error
        found = state.get("format") if isinstance(state, dict) else None
        if found != CHECKPOINT_FORMAT:
            raise InputError(f"the checkpoint {path} has format {found}, this hierroom reads {CHECKPOINT_FORMAT}")
        return state

    def append_metrics(self, row: Mapping[str, float]) -> None:
        """Append a row to metrics.csv.

        Raises:
            InputError: if it cannot be written; the previous rows are still there.
        """
        path = self.path / "metrics.csv"
        text = io.StringIO()
        writer = csv.DictWriter(text, list(row))
        size = path.stat().st_size if path.exists() else 0
        if size == 0:
            writer.writeheader()
        writer.writerow(row)
        try:
            with path.open("a", newline="") as file:
                file.write(text.getvalue())
        except OSError as error:
            with suppress(OSError):
                os.truncate(path, size)
            raise InputError(f"cannot write {path}: {error.strerror}") from error

    def metrics(self) -> list[dict[str, float]]:
        """Read the rows of metrics.csv.

        Raises:
            InputError: if it is broken.
        """
        path = self.path / "metrics.csv"
        if not path.exists():
            return []
        try:
            with path.open(newline="") as file:
                return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
        except (TypeError, ValueError) as error:  # a row is too short or too long, or a value is not a number
            raise InputError(f"{path} is broken: {error}") from error

    def drop_metrics_after(self, steps: int) -> None:
        """Delete the rows logged after the checkpoint from which training resumes."""
        rows, path = self.metrics(), self.path / "metrics.csv"
        if rows:
            header, *lines = path.read_bytes().splitlines(keepends=True)
            kept = [line for row, line in zip(rows, lines, strict=True) if row["steps"] <= steps]
            write_atomically(path, b"".join([header, *kept]))

    def save_summary(self, summary: Mapping[str, Any]) -> None:
        """Write summary.json."""
        write_atomically(self.path / "summary.json", to_json(summary).encode())


def unused_path(path: Path) -> Path:
    """The path itself if it is free, else the first free one of path-2, path-3, ..."""
    candidate, number = path, 2
    while candidate.exists():
        candidate, number = path.with_name(f"{path.name}-{number}"), number + 1
    return candidate
