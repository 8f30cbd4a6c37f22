"""The folder of a training run: config, tables, checkpoints, summary. Tables grow; other files are written whole."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import checkpoint, predicted, provenance
from hierroom.runs.folder.csv_table import CSVTable
from hierroom.runs.folder.run_lock import RunLock, RunLockedError
from hierroom.support.errors import CheckpointError, InputError
from hierroom.support.files import (
    MOST_STATE,
    delete,
    is_unfinished,
    read_bytes,
    read_json,
    refuse_foreign,
    remove_unfinished,
    sync,
    to_json,
    usable_path,
    write_atomically,
)
from hierroom.support.output import warn

_INTERRUPTED = "-interrupted"
FILMS = ("escape.gif", "success.gif", "failure.gif", "episode.gif")
_WRITTEN = ("config.json", predicted.FILE, "logs.json", "summary.json", "learning_curve.png", *FILMS)
"""The files of a run besides its provenance, tables and checkpoints."""
_COLUMNS: Mapping[str, Mapping[str, Any]] = {
    "metrics": {"numbers": {"steps": 0, "success_rate": None, "episode_length": None}},
    "evaluations": {
        "numbers": dict.fromkeys(("seconds", "graph", "success_rate", "length_over_shortest", "return"))
        | {"steps": 0, "episodes": 1, "length": 0},
        "texts": ("graph",),
    },
}
"""The columns that tables must have, see `CSVTable`. Cells of ``episodes.csv``, which may be long, are not checked."""


class RunFolder:
    """A training run on disk: config, provenance, tables, checkpoints named by their steps, summary, pictures, a lock.

    ``config.json`` has the content of user-defined goal graphs, so the run can be resumed even if their files change.
    """

    def __init__(self, path: str | Path):
        self.path = usable_path(path)
        self.checkpoints = self.path / "checkpoints"
        self.tables = tuple(CSVTable(self.path / f"{name}.csv", **_COLUMNS.get(name, {})) for name in checkpoint.TABLES)
        self.metrics, self.evaluations, self.episodes = self.tables
        self.lock = RunLock(self.path)

    @classmethod
    def create(cls, path: str | Path, config: TrainConfig) -> RunFolder:
        """Create the folder of a run; it may exist if it is empty, or if a killed call left it."""
        run = cls(path)
        try:
            for folder in (run.path, *run.path.parents):
                if folder.exists() and not folder.is_dir():
                    why = f"{folder} is not a folder; choose another --out"
                    raise InputError(f"cannot create the run folder {run.path}: {why}")
            run.path.mkdir(parents=True, exist_ok=True)
            run._refuse_content()  # before the lock adds a file
            with run.lock:
                run._refuse_content()  # another process may have written there
                remove_unfinished(run.path)
                run.checkpoints.mkdir(exist_ok=True)
                run.save_config(config)
        except (FileExistsError, NotADirectoryError, RunLockedError):
            raise InputError(f"{run.path} is not an empty folder; choose another --out, or --resume it") from None
        except OSError as error:
            raise InputError(f"cannot create the run folder {run.path}: {error.strerror}") from error
        return run

    def _refuse_content(self) -> None:
        for path in self.path.iterdir():
            is_ours = path == self.checkpoints and not path.is_symlink()
            is_empty = is_ours and all(map(is_unfinished, path.iterdir()))
            if not (is_empty or path.name == RunLock.FILE or is_unfinished(path)):
                raise FileExistsError

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Open the folder of an existing run."""
        run = cls(path)
        if not (run.path / "config.json").is_file():
            inside = next((one.parent for at in ("*", "runs/*") for one in run.path.glob(f"{at}/config.json")), None)
            hint = ": it has no config.json" if run.path.exists() else ": there is no such folder"
            hint = f", but contains some, such as {inside}" if inside else hint
            raise InputError(f"{run.path} is not a run folder{hint}")
        return run

    def save_config(self, config: TrainConfig) -> None:
        """Write config.json."""
        write_atomically(self.path / "config.json", to_json(config.to_dict()))

    def config(self) -> TrainConfig:
        """Read the config of the run."""
        path = self.path / "config.json"
        table = read_json(path)
        try:
            return TrainConfig.from_dict(table)
        except (InputError, ValueError) as error:  # ValueError: JSON can hold half of a surrogate pair
            raise InputError(f"{path}: {error}") from error

    def save_checkpoint(self, state: Mapping[str, Any], *, is_interrupted: bool = False) -> Path:
        """Write a checkpoint, named by its steps, from the result of `Trainer.state_dict`.

        That of an interrupted run is deleted by the next one.
        """
        content = checkpoint.to_bytes({**state, "tables": {table.path.stem: table.n_rows for table in self.tables}})
        for table in self.tables:
            sync(table.path)  # a resumed run relies on the rows before its checkpoint
        path = self.checkpoints / f"{state['steps']:012d}{_INTERRUPTED * is_interrupted}.pt"
        write_atomically(path, content)
        if not is_interrupted:
            self._remove_interrupted()
        return path

    def _checkpoint_paths(self) -> dict[int, Path]:
        paths = [path for path in self.checkpoints.glob("*.pt") if path.stem.removesuffix(_INTERRUPTED).isdecimal()]
        return {int(path.stem.removesuffix(_INTERRUPTED)): path for path in sorted(paths)}

    @property
    def saved_steps(self) -> int:
        """Return the steps of the newest checkpoint; 0 without one."""
        return max(self._checkpoint_paths(), default=0)

    def _remove_interrupted(self) -> None:
        kept = max(self._checkpoint_paths().items(), default=(0, None))[1]
        for path in self.checkpoints.glob(f"*{_INTERRUPTED}.pt"):
            if path != kept:
                with suppress(OSError):  # the next call tries again
                    delete(path)

    def refuse_foreign(self) -> None:
        """Refuse links and special files at the paths that a run writes, cuts or deletes; change nothing."""
        copies, written = self.path / provenance.COPIES, (self.path / name for name in (*_WRITTEN, provenance.FILE))
        refuse_foreign(
            replaced=[*written, *self._checkpoint_paths().values()],
            changed=[table.path for table in self.tables],
            folders=[
                self.checkpoints,
                copies,
                *filter(os.path.isdir, copies.rglob("*")),
                *copies.glob("session-*[0-9]"),
            ],
        )

    def tidy(self) -> None:
        """Delete files that a killed process left: unfinished ones, and outdated checkpoints of interrupted runs."""
        self.refuse_foreign()
        remove_unfinished(self.path)
        self._remove_interrupted()
        self.checkpoints.mkdir(exist_ok=True)  # git and some archives leave out an empty folder

    @property
    def is_untrained(self) -> bool:
        """Return whether there is no checkpoint and no table yet, so that there is nothing to lose."""
        return not self._checkpoint_paths() and not any(table.path.exists() for table in self.tables)

    def load_checkpoint(self, steps: int | None = None) -> dict[str, Any]:
        """Read the checkpoint after ``steps`` steps, by default the newest; no code from the file is executed."""
        paths = self._checkpoint_paths()
        if not paths:
            raise InputError(f"{self.path} has no checkpoint in {self.checkpoints.name}/")
        if steps is not None and steps not in paths:
            raise InputError(f"{self.path} has checkpoints after {', '.join(map(str, paths))} steps, not {steps}")
        steps = max(paths) if steps is None else steps
        path = paths[steps]
        content = read_bytes(path, MOST_STATE, "the checkpoint ")
        try:
            state = checkpoint.from_bytes(content)
            if state["steps"] != steps:
                raise InputError(f"is one after {state['steps']:,} steps, and has been renamed")
            return state
        except InputError as error:
            newest, *others = sorted(paths.values(), reverse=True)
            is_alone = not others or path != newest or isinstance(error, checkpoint.OtherFormatError)
            before = "" if is_alone else f"; without it the run goes on from {others[0].name}"
            raise CheckpointError(f"the checkpoint {path} {error}{before}") from error

    def require_same_config(
        self, config: TrainConfig, checkpoint: Mapping[str, Any], ignored: Collection[str] = ()
    ) -> None:
        """Refuse a config that differs from a checkpoint's, except in ignored entries; see `differences`."""
        try:
            trained = TrainConfig.from_dict(json.loads(checkpoint["config"]))
        except (KeyError, TypeError, ValueError, RecursionError, InputError) as error:
            raise InputError(f"a checkpoint of {self.path} has no readable config") from error
        if differences := config.differences(trained, ignored):
            raise InputError(
                f"{self.path / 'config.json'} has changed since the run was trained: {', '.join(differences)}; put it "
                "back, or begin a new run from it by --config"
            )

    def keep_rows(self, checkpoint: Mapping[str, Any]) -> None:
        """Delete the rows after a checkpoint, which a resumed run writes again; warn if earlier rows are missing."""
        counts, steps = [(table, checkpoint["tables"][table.path.stem]) for table in self.tables], checkpoint["steps"]
        for table, n_rows in counts:  # check all tables before any is changed
            try:
                table.measure(n_rows, steps)
            except InputError as error:
                raise InputError(f"{error}; mend it, or delete the table to go on without its rows") from error
        for table, n_rows in counts:
            if (n_kept := table.keep(n_rows, steps)) < n_rows:
                warn(f"{table.path} has lost {n_rows - n_kept:,} of {n_rows:,} rows; the run goes on without them")

    def save_summary(self, summary: Mapping[str, Any]) -> None:
        """Write summary.json."""
        write_atomically(self.path / "summary.json", to_json(summary))


def claim_folder(path: Path) -> Path:
    """Create the first of the folders path, path-2, ... that does not exist; each process gets another one."""
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
