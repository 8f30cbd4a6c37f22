"""Choose the measure, fit the model of training steps, and write what `hierroom advise` reads.

    python -m benchmarks.prediction.play     # random play in every task (an hour of one core)
    python -m benchmarks.prediction          # the tables, and hierroom/lab/advise/model.json
    python -m benchmarks.prediction --new    # predictions of tasks that nobody has trained on; once, before their runs
    python -m benchmarks.prediction.judge    # these predictions, and the runs that were made afterwards

Two tables of each measure, method and milestone: fitted on all worlds but one and tried on this one, and fitted on each
home world with tasks left out, ten times a tenth. Two of the chosen fits: tried on each world from all others, with the
kind of interval that ships, and on other levels, which no fit has seen. A family of the arena is a world, as soon as it
has all its runs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import tyro

from benchmarks.arena.runs import whole_families
from benchmarks.prediction.candidates import CANDIDATES
from benchmarks.prediction.fit import Score, score
from benchmarks.prediction.held_out import across, in_one_world, in_other_worlds, within
from benchmarks.prediction.play import RESULTS, config_of, new_tasks
from benchmarks.prediction.rows import ARENA, Runs, known_tasks, read_runs, task_medians
from hierroom.lab.advise import model
from hierroom.lab.advise.measures import MEASURES, Known
from hierroom.lab.advise.outside import MOST_RANDOM_SUCCESS, OTHER, outside
from hierroom.lab.advise.prediction import predict
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text

FOLDER = RESULTS / "prediction"
WORLDS = ("escape_room", "workshop")
WANTED = (
    ("hippo", "steps_to_50"),
    ("hippo", "steps_to_95"),
    ("ppo-bonus", "steps_to_50"),
    ("ppo-bonus", "steps_to_95"),
    ("ppo", "steps_to_50"),
)
CHOSEN = {
    ("hippo", "steps_to_50"): "W x kinds",
    ("hippo", "steps_to_95"): "W",
    ("ppo-bonus", "steps_to_50"): "W x kinds",
    ("ppo", "steps_to_50"): "W",
}
"""The measure of each prediction, chosen after the runs, see docs/advise.md. PPO+Bonus to 95% is left out, as no
measure carries from one world to the other."""


@dataclass(frozen=True)
class Options:
    """Fit the model, or predict new tasks with it.

    Args:
        new: write predictions of new tasks instead, from the model that is there.
    """

    new: bool = False


def fitted_runs(method: str, milestone: str, known: dict[str, Known], uses: dict[str, str]) -> Runs:
    """Return the runs of a method that fits are made to: those at home, and in families of the arena that are whole.

    Tasks that random play wins are left out: nothing remains to be learned there, so that runs show no steps.
    """
    runs = read_runs(method, milestone, known, uses)
    is_won = np.array([known[task].random_success > MOST_RANDOM_SUCCESS for task in runs.tasks.tolist()])
    return runs.where(np.isin(runs.worlds, [*WORLDS, *whole_families(ARENA)]) & ~is_won)


def table(known: dict[str, Known], uses: dict[str, str]) -> Iterator[dict[str, Any]]:
    """Yield a row for each way to leave tasks out, method, milestone and measure."""
    for method, milestone in WANTED:
        runs = fitted_runs(method, milestone, known, uses)
        for name, measure in CANDIDATES.items():
            x = runs.measured(known, measure)
            for way, split, worlds in (("a world", across, np.unique(runs.worlds)), ("tasks", within, WORLDS)):
                kept = np.isfinite(x) & np.isin(runs.worlds, worlds)
                part = runs.where(kept)
                predicted, half = split(part, x[kept])
                scored = score(part, predicted, predicted - half, predicted + half)
                yield {"left out": way, "method": method, "milestone": milestone, "measure": name, **rounded(scored)}


def worlds_left_out(known: dict[str, Known], uses: dict[str, str]) -> Iterator[dict[str, Any]]:
    """Yield how the shipped kind of interval does in each world, from all others."""
    for (method, milestone), name in CHOSEN.items():
        runs = fitted_runs(method, milestone, known, uses)
        x = runs.measured(known, MEASURES[name])
        runs, x = runs.where(np.isfinite(x)), x[np.isfinite(x)]
        for world in np.unique(runs.worlds):
            own = runs.worlds == world
            intercept, slope, _, low, high = in_other_worlds(runs.where(~own), x[~own])
            predicted = intercept + slope * x[own]
            scored = score(runs.where(own), predicted, predicted + np.log(low), predicted + np.log(high))
            yield {"left out": world, "method": method, "milestone": milestone, "measure": name, **rounded(scored)}


def rounded(scored: Score) -> dict[str, Any]:
    """Return a score for a table."""
    return {name: value if isinstance(value, int) else f"{value:.3g}" for name, value in scored._asdict().items()}


def fits(known: dict[str, Known], uses: dict[str, str]) -> Iterator[model.Fit]:
    """Yield the fits of the model: one for each home world, and one for worlds that have no runs."""
    for method, milestone in CHOSEN:
        every = fitted_runs(method, milestone, known, uses)
        for world in (*WORLDS, OTHER):
            name = CHOSEN[method, milestone]
            x = every.measured(known, MEASURES[name])
            kept = np.isfinite(x) & ((every.worlds == world) | (world == OTHER))
            runs, x = every.where(kept), x[kept]
            if not len(runs):
                continue
            numbers = (round(one, 6) for one in (in_other_worlds if world == OTHER else in_one_world)(runs, x))
            yield model.Fit(method, milestone, world, name, *numbers, len(np.unique(runs.tasks)), len(runs))


def write_model(known: dict[str, Known], uses: dict[str, str]) -> None:
    """Write the model's file."""
    runs = fitted_runs(*WANTED[0], known, uses)
    used, worlds = {*runs.tasks.tolist()}, {*runs.worlds.tolist()}
    inside = [known[task] for task in used if np.isfinite(known[task].expected_steps)]
    names = ("expected_steps", "goals", "limit")
    bounds = {name: [f([getattr(one, name) for one in inside]) for f in (min, max)] for name in names}
    found = [asdict(one) for one in fits(known, uses)]
    text = {"version": "3", "worlds": len(worlds), "horizon": 1_000_000, "bounds": bounds, "fits": found}
    plain = json.dumps(text | {"tasks": dict(measured_tasks(known, uses))}, indent=1)
    write_atomically(model.FILE, re.sub(r"\[\s+([^][{}]*?),\s+([^][{}]*?)\s+\]", r"[\1, \2]", plain) + "\n")
    for one in found:
        print(", ".join(f"{value:.3g}" if isinstance(value, float) else str(value) for value in one.values()))


def measured_tasks(known: dict[str, Known], uses: dict[str, str]) -> Iterator[tuple[str, list[int | None]]]:
    """Yield each task of the fits with the measure of HiPPO's steps to 50% and their median; None: never."""
    runs = fitted_runs("hippo", "steps_to_50", known, uses)
    measure = MEASURES[CHOSEN["hippo", "steps_to_50"]]
    for task, value, steps in zip(*task_medians(runs, runs.measured(known, measure)), strict=True):
        if np.isfinite(value):
            yield str(task), [round(np.exp(value)), None if np.isinf(steps) else round(np.exp(steps))]


def other_levels(known: dict[str, Known], uses: dict[str, str]) -> Iterator[dict[str, Any]]:
    """Yield how the model's wide fits do on levels that no fit has seen, and that lie inside by the rule."""
    fitted = model.read_model.__wrapped__()
    for method, milestone in CHOSEN:
        runs = read_runs(method, milestone, known, uses)
        fit_of = fitted.fits[method, milestone, OTHER]
        x = runs.measured(known, MEASURES[fit_of.measure])
        inside = [
            not outside(known[task], np.exp(value), fitted.bounds) for task, value in zip(runs.tasks, x, strict=True)
        ]
        kept = (runs.worlds == "levels") & inside & np.isfinite(x)
        if kept.any():
            predicted = fit_of.intercept + fit_of.slope * x[kept]
            scored = score(runs.where(kept), predicted, predicted + np.log(fit_of.low), predicted + np.log(fit_of.high))
            yield {"left out": "other levels", "method": method, "milestone": milestone} | {
                "measure": fit_of.measure,
                **rounded(scored),
            }


def new_predictions(known: dict[str, Known]) -> Iterator[dict[str, Any]]:
    """Yield what the model predicts of each new task."""
    fitted = model.read_model()
    for row in new_tasks():
        if (task := config_of(row).key) not in known:
            continue
        world = "workshop" if task.startswith("workshop:") else "escape_room"
        predictions, reason = predict(known[task], world, fitted)
        cells: dict[str, Any] = {"task": task, "model": fitted.name, "outside": reason or ""}
        for method, one in predictions.items():
            for milestone in ("steps_to_50", "steps_to_95"):
                steps = getattr(one, milestone)
                for name, value in (("", steps), ("_low", steps and steps.low), ("_high", steps and steps.high)):
                    cells[f"{method} {milestone}{name}"] = "" if value is None else f"{value:.4g}"
        yield cells


def write_and_print(rows: list[dict[str, Any]], file: str) -> None:
    """Write a table of the results, and print it."""
    write_atomically(FOLDER / file, csv_text(rows))
    for row in rows:
        print("  ".join(f"{value!s:<12}" for value in row.values()))


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    known, uses = known_tasks()
    if options.new:
        if (FOLDER / "new.csv").exists():
            raise InputError(f"predictions are made once, before the runs: {FOLDER / 'new.csv'} is there already")
        rows = [*new_predictions(known)]
        write_atomically(FOLDER / "new.csv", csv_text(rows, [*dict.fromkeys(name for row in rows for name in row)]))
        print(f"predictions of {len(rows)} tasks are in {FOLDER / 'new.csv'}")
        return 0
    write_model(known, uses)
    write_and_print([*table(known, uses), *worlds_left_out(known, uses), *other_levels(known, uses)], "table.csv")
    return 0


if __name__ == "__main__":
    run(main)
