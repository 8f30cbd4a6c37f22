"""The folder of a training run: config, tables, checkpoints and summary. Tables grow, other files are written whole."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.errors import InputError
from hierroom.files import to_json, write_atomically
from hierroom.training import checkpoint
from hierroom.training.config import TrainConfig
from hierroom.training.csv_table import CSVTable


class RunFolder:
    """A training run on disk.

    The folder contains ``config.json``, ``provenance.json`` and ``modules/`` (see `training.provenance`), the tables
    ``metrics.csv``, ``evaluations.csv`` and ``episodes.csv``, ``checkpoints/`` (named by their steps),
    ``summary.json``, TensorBoard events and pictures. ``config.json`` holds goal graphs of one's own by their content,
    so that the run can continue even if their files change.

    Args:
        path: the folder.

    Attributes:
        metrics: a row for each time that training is logged.
        evaluations: for each evaluation during training and each goal graph a row: ``steps`` and ``seconds`` trained,
            ``graph``, ``episodes``, ``success_rate`` with its 95% interval ``success_low`` and ``success_high``,
            ``length``, ``length_over_shortest`` and the controller's ``return``.
        episodes: a row for each episode of training: the ``steps`` trained when it ended, ``env``, ``graph``,
            ``success`` (0 or 1), ``length``, the controller's ``return``, and the ``goals`` achieved in their order.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self.metrics = CSVTable(self.path / "metrics.csv")
        self.evaluations = CSVTable(self.path / "evaluations.csv")
        self.episodes = CSVTable(self.path / "episodes.csv")

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
        """Write a checkpoint, named by its steps, from the result of `Trainer.state_dict`.

        Raises:
            InputError: if an entry, which a user's own code may have given, is one that could not be read again.
        """
        path = self.checkpoints / f"{state['steps']:012d}.pt"
        write_atomically(path, checkpoint.to_bytes(state))
        return path

    def load_checkpoint(self, steps: int | None = None) -> dict[str, Any]:
        """Read the checkpoint after ``steps`` steps, by default the newest; no code from the file is executed.

        Raises:
            InputError: if there is none, it is damaged, or another version of hierroom wrote it in another format.
        """
        paths = {int(path.stem): path for path in sorted(self.checkpoints.glob("*.pt")) if path.stem.isdecimal()}
        if not paths:
            raise InputError(f"{self.path} has no checkpoint in {self.checkpoints.name}/")
        if steps is not None and steps not in paths:
            raise InputError(f"{self.path} has checkpoints after {', '.join(map(str, paths))} steps, not {steps}")
        path = paths[max(paths) if steps is None else steps]
        try:
            return checkpoint.from_bytes(path.read_bytes())
        except OSError as error:
            raise InputError(f"cannot read the checkpoint {path}: {error.strerror}") from error
        except InputError as error:
            raise InputError(f"the checkpoint {path} {error}") from error

    @property
    def tables(self) -> tuple[CSVTable, ...]:
        """All tables that grow during training."""
        return self.metrics, self.evaluations, self.episodes

    def save_summary(self, summary: Mapping[str, Any]) -> None:
        """Write summary.json."""
        write_atomically(self.path / "summary.json", to_json(summary).encode())


def claim_folder(path: Path) -> Path:
    """Create the first of the folders path, path-2, path-3, ... that is not there; no two processes get the same.

    Raises:
        InputError: if it cannot be created.
    """
    candidate, number = path, 1
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        while True:
            try:
                candidate.mkdir()
                return candidate
            except FileExistsError:
                number += 1
                candidate = path.with_name(f"{path.name}-{number}")
    except OSError as error:
        raise InputError(f"cannot create the folder {error.filename or candidate}: {error.strerror}") from error
