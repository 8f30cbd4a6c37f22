"""Random play in the arena's tasks, and predictions from it, written before any of their runs."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.arena.families import Family
from benchmarks.prediction.play import read_rows
from benchmarks.prediction.rows import known_of
from hierroom.complexity.report import analyze
from hierroom.goals import Rules
from hierroom.lab.advise.costs import measure_costs
from hierroom.lab.advise.measures import Known
from hierroom.lab.advise.model import read_model
from hierroom.lab.advise.outside import world_of
from hierroom.lab.advise.prediction import predict
from hierroom.lab.advise.rule_check import check_rules
from hierroom.support.errors import require_number
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import make_world

METHODS = ("hippo", "ppo-bonus", "ppo")
MILESTONES = ("steps_to_50", "steps_to_95")


def add_rows(
    out: Path, identities: Iterable[Mapping[str, str]], row_of: Callable[..., Mapping[str, Any]], processes: int = 1
) -> None:
    """Write what ``row_of`` returns for each identity that has no row; what it raises is a row's ``error``."""
    rows: list[Mapping[str, Any]] = [*read_rows(out)]
    require_number("processes", processes, 1, is_whole=True)
    missing = [one for one in identities if not any(one.items() <= row.items() for row in rows)]

    def found(identity: Mapping[str, str]) -> Mapping[str, Any]:
        try:
            return {**identity, **row_of(**identity), "error": ""}
        except Exception as error:  # of somebody else's environment
            return {**identity, "error": traceback.format_exception_only(error)[-1].strip()}

    with ThreadPoolExecutor(processes) as pool:
        try:
            for one in as_completed([pool.submit(found, identity) for identity in missing]):
                rows = [*read_rows(out), one.result()]  # another command may have written some
                write_atomically(out, csv_text(rows, [*dict.fromkeys(name for row in rows for name in row)]))
                print(*[*rows[-1].values()][:6], flush=True)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def predict_rows(families: Iterable[Family], folder: Path) -> None:
    """Play in each task, and predict it with the model that is there."""
    by_name = {family.name: family for family in families}
    tasks = [{"family": one.name, "task": task} for one in by_name.values() for task in one.tasks()]
    add_rows(folder / "play.csv", tasks, lambda family, task: played(by_name[family], task))
    play = {(row["family"], row["task"]): row for row in read_rows(folder / "play.csv")}
    add_rows(
        folder / "predictions.csv", tasks, lambda family, task: predicted(by_name[family], task, play[family, task])
    )


def played(family: Family, task: str) -> dict[str, Any]:
    """Play in a task; return what is known of it before training, and how play agrees with its rules."""
    config = EnvConfig.of_arguments(family.tasks()[task])
    costs = measure_costs(config, play_steps=family.play_steps)
    with closing(make_world(config, 1)) as world:
        rules, goals, again = world.rules, world.goals, getattr(world, "is_repeatable", False)
    assert rules is not None
    check = ""
    if isinstance(rules, Rules):
        once = np.array(goals.names)[~np.broadcast_to(again, len(goals))].tolist()
        check = str(check_rules(rules, costs.sequences, goals.names, goals.names[goals.target], once))
    measures = {**asdict(Known.of(costs, rules)), "hitting_time": analyze(rules).hitting_time}
    return {
        **{name: f"{value:.6g}" for name, value in measures.items()},
        **{"actions": world.n_actions, "episodes": costs.episodes, "play_steps": costs.steps},
        "hardest": costs.hardest,
        "rules": " / ".join(check.splitlines()),
    }


def predicted(family: Family, task: str, row: Mapping[str, str]) -> dict[str, str]:
    """Return the predicted steps of each method and milestone with their interval; empty where nothing is predicted."""
    if row["error"]:
        return {"model": "", "outside": row["error"]}
    model, where = read_model(), world_of(EnvConfig.of_arguments(family.tasks()[task]))
    predictions, reason = predict(known_of(row), where, model)
    found = {"model": model.name, "outside": reason or ""}
    for method in METHODS:
        one = predictions.get(method)
        for milestone in MILESTONES:
            steps = one and getattr(one, milestone)
            for end, value in (("", steps), ("_low", steps and steps.low), ("_high", steps and steps.high)):
                found[f"{method} {milestone}{end}"] = "" if value is None else f"{value:.4g}"
    return found
