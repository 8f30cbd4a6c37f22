"""Comparison of two run folders: every file, except for times and commands."""

import csv
import json
import logging
from pathlib import Path
from typing import Any

from same_state import equal
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from hierroom.runs.folder.run_folder import RunFolder

CLOCKS = ("seconds", "compile_seconds", "steps_per_second")
OF_COMMANDS = ("provenance.json", ".lock")
"""Files about how a run was made, which differ if it was killed."""


def differences(one: Path, other: Path) -> list[str]:
    """List the differences between two runs, a line for each file."""
    names = [_names(path) for path in (one, other)]
    lines = [f"{name} is in {'one' if name in names[0] else 'other'} only" for name in sorted(names[0] ^ names[1])]
    for name in sorted(names[0] & names[1]):
        read = {".csv": _table, ".json": _json, ".pt": _checkpoint}.get(Path(name).suffix, Path.read_bytes)
        if not equal(read(one / name), read(other / name)):
            lines.append(f"{name} differs")
    if (events := [scalars(path) for path in (one, other)])[0] != events[1]:
        lines.append("the events differ: " + ", ".join(_differing(*events))[:300])
    return lines


def _names(path: Path) -> set[str]:
    files = {file.relative_to(path).as_posix() for file in path.rglob("*") if file.is_file()}
    return {name for name in files if not name.startswith("events.out") and name not in OF_COMMANDS}


def _table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [{name: text for name, text in row.items() if name not in CLOCKS} for row in rows]


def _json(path: Path) -> dict[str, Any]:
    table = json.loads(path.read_text(encoding="utf-8"))
    return {name: value for name, value in table.items() if name not in CLOCKS and not name.startswith("seconds_to_")}


def _checkpoint(path: Path) -> dict[str, Any]:
    state = RunFolder.open(path.parents[1]).load_checkpoint(int(path.stem))
    return {name: value for name, value in state.items() if name not in CLOCKS}


def scalars(path: Path) -> dict[str, list[tuple[int, str]]]:
    """Return the steps and values that TensorBoard shows of a run, by tag, without times."""
    logging.getLogger("tensorboard").setLevel(logging.ERROR)  # it logs the events that it hides
    events = EventAccumulator(str(path), size_guidance={"scalars": 0})
    events.Reload()
    tags = [tag for tag in events.Tags()["scalars"] if not tag.startswith("time/")]
    shown = {tag: [(one.step, repr(one.value)) for one in events.Scalars(tag)] for tag in tags}
    return shown | {tag: [] for tag in events.summary_metadata if tag.startswith("_hparams_")}


def _differing(one: dict, other: dict) -> list[str]:
    tags = sorted(tag for tag in one.keys() | other.keys() if one.get(tag) != other.get(tag))
    return [f"{tag} {len(one.get(tag, ()))} and {len(other.get(tag, ()))} points" for tag in tags]
