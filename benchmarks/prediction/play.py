"""Random play in every task of the prediction's rows, and in tasks that nobody has trained on.

    python -m benchmarks.prediction.play

A row a task, in benchmarks/results/prediction/play.csv. Rows that are there already are kept. Equal seeds and steps
give equal rows: with ``--out again.csv`` every task is played for as many steps as its committed row was, 600,000,
1,000,000 or 1,500,000 (column ``settings``), and the tables are equal.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
import tyro

from hierroom.goals import enumerate_graphs
from hierroom.lab.advise.costs import measure_costs
from hierroom.lab.advise.measures import Known
from hierroom.lab.advise.outside import WORKSHOP_LIMIT
from hierroom.support.cli import progress_bar, run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import make_world
from hierroom.worlds.workshop.tech_tree import Shape

RESULTS = Path("benchmarks/results")
PLAY = RESULTS / "prediction" / "play.csv"
SWEEPS = {
    **{"study": "escape_room", "conjecture": "workshop", "study_levels": "levels", "drop_key": "levels"},
    **{"predicted_rooms": "escape_room", "predicted_trees": "workshop"},
}
"""The runs that are predicted: whose rows fit the model, and of other levels, which test what lies outside."""
NEW_TREES, NEW_ROOMS, NEW_SEED = 30, 20, 72


@dataclass(frozen=True)
class Options:
    """Play in every task.

    Args:
        play_steps: of each task; by default as many as in its committed row, or a million.
        seed: of levels and actions.
        out: the table.
    """

    play_steps: int | None = None
    seed: int = 0
    out: Path = PLAY


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table, or none if there is no file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [*csv.DictReader(file)]


def config_of(row: dict[str, str]) -> EnvConfig:
    """Return the environments that a row of a sweep trained in, or a row of `new_tasks` names."""
    name, variant = row["graph"], row.get("variant") or ""
    if name.startswith("workshop:"):
        return EnvConfig(task=name, max_steps=WORKSHOP_LIMIT)
    limit = 300 if variant.startswith("shorter limit") else None
    drop = variant.startswith("drop") or row.get("sweep") == "drop_key"
    return EnvConfig(graph=name, size=int(row["size"]), max_steps=limit, drop_key=drop)


def new_tasks() -> list[dict[str, str]]:
    """Return Workshop trees and EscapeRoom graphs drawn at random, and not chosen by any measure.

    Trees have 4 to 12 goals, any shape and a seed of 1000 to 9999; graphs 3 to 6 rooms. None is in the study.
    """
    random = np.random.default_rng(NEW_SEED)
    used = {row["graph"] for row in read_rows(RESULTS / "study" / "measures.csv")}
    names: list[str] = []
    while len(names) < NEW_TREES:
        goals, seed = random.integers(4, 13), random.integers(1000, 10_000)
        names.append(f"workshop:{goals}:{seed}:{random.choice(get_args(Shape))}")
    every = [one.name for rooms in range(3, 7) for one in enumerate_graphs(rooms) if one.name not in used]
    names += random.choice(every, NEW_ROOMS, replace=False).tolist()
    return [{"graph": name, "size": "19", "sweep": "new"} for name in names]


def tasks() -> Iterator[tuple[str, dict[str, str]]]:
    """Yield each task once: what its rows are for, and one of them."""
    seen = set()
    for sweep, use in SWEEPS.items():
        for row in read_rows(RESULTS / sweep / "sweep.csv"):
            row |= {"sweep": sweep}
            if (key := config_of(row).key) not in seen:
                seen.add(key)
                yield use, row
    for row in new_tasks():
        if config_of(row).key not in seen:
            yield "new", row


def played_row(config: EnvConfig, use: str, play_steps: int, seed: int) -> dict[str, Any]:
    """Play in a task and return its row."""
    costs = measure_costs(config, play_steps=play_steps, seed=seed)
    known = Known.of(costs, make_world(config, 1).rules)
    interval = {"expected_low": costs.expected_steps.low, "expected_high": costs.expected_steps.high}
    settings = f"play_steps={play_steps} seed={seed}"
    return {"task": config.key, "use": use, **asdict(known), **interval, "settings": settings}


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    rows: dict[str, dict[str, Any]] = {row["task"]: row for row in read_rows(options.out)}
    steps = {row["task"]: int(row["settings"].split()[0].split("=")[1]) for row in read_rows(PLAY)}
    with progress_bar() as bar:
        for use, row in bar.track([*tasks()], description="playing"):
            config = config_of(row)
            if config.key in rows:
                continue
            try:
                n = options.play_steps or steps.get(config.key, 1_000_000)
                rows[config.key] = played_row(config, use, n, options.seed)
            except InputError as error:
                print(f"{config.key}: {error}")
                continue
            write_atomically(options.out, csv_text([*rows.values()]))
    print(f"{len(rows)} tasks are in {options.out}")
    return 0


if __name__ == "__main__":
    run(main)
