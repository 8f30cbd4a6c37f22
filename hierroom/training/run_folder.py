"""The folder of a training run: config, tables, checkpoints and summary. Tables grow, other files are written whole."""

from __future__ import annotations

import io
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import torch

from hierroom.errors import InputError
from hierroom.files import to_json, write_atomically
from hierroom.training.config import TrainConfig
from hierroom.training.csv_table import CSVTable
from hierroom.training.plain_state import plain_state

CHECKPOINT_FORMAT = 7


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
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"cannot read {path}: {error}") from error

    def save_checkpoint(self, state: Mapping[str, Any]) -> Path:
        """Write a checkpoint, named by its steps, from the result of `Trainer.state_dict`.

        Raises:
            InputError: if an entry, which a user's own code may have given, is one that could not be read again.
        """
        plain = {name: plain_state(entry, name) for name, entry in state.items()}
        buffer = io.BytesIO()
        torch.save({"format": CHECKPOINT_FORMAT, **plain}, buffer)
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

    def require_same_config(
        self, config: TrainConfig, checkpoint: Mapping[str, Any], besides: Collection[str] = ()
    ) -> None:
        """Refuse a config that is not the one with which a checkpoint was trained.

        Args:
            config: what config.json says now; steps, threads and device may be others.
            checkpoint: what `load_checkpoint` gave.
            besides: entries that are not used, and so may be others too.

        Raises:
            InputError: if another entry differs, or the checkpoint does not hold its config.
        """
        try:
            trained = TrainConfig.from_dict(json.loads(checkpoint["config"]))
        except (KeyError, TypeError, ValueError, RecursionError, InputError) as error:
            raise InputError(f"a checkpoint of {self.path} does not tell the config it was trained with") from error
        if differences := config.differences(trained, besides):
            raise InputError(
                f"{self.path / 'config.json'} has changed since the run was trained: {', '.join(differences)}; put it "
                "back, or begin a new run from it by --config"
            )

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
