"""Runs of the arena: each in a process of its own, and a row of runs.csv."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.arena.families import FAMILIES
from benchmarks.arena.predictions import METHODS, add_rows
from benchmarks.prediction.play import read_rows
from hierroom.runs.config.run_name import plain
from hierroom.support.errors import InputError

if TYPE_CHECKING:
    from hierroom.agents.evaluation import Evaluation
    from hierroom.runs.folder.run_folder import RunFolder
    from hierroom.runs.trainer import Trainer

SEEDS, EVERY = 2, 4
"""Seeds of each task; each ``EVERY``-th task has one more, which shows the noise."""
EVALUATIONS = 20
EVALUATED = 0.5
"""Steps of all evaluations of a run, as a share of its budget."""
LEARNED, IN_A_ROW = 0.95, 3
"""A run ends early when this many evaluations in a row have this success, as all milestones are then known."""
ARMS: Mapping[str, Mapping[str, str]] = {
    "ppo-bonus, observes the goal": {"method": "ppo-bonus", "meta": "fixed-dfs"},
    "hippo, goal not observed": {"method": "hippo"},
    "hippo, reward for any goal": {"method": "hippo", "reward": "benchmarks.variants:CutBonus"},
    "hippo, random goals": {"method": "hippo", "meta": "random"},
}
"""What of HiPPO makes its lead: one part changed at a time."""
NOT_OBSERVED = "hippo, goal not observed"
KEPT = Path("runs/arena")
"""Where runs are, so that one that was cut off goes on."""


@dataclass(frozen=True)
class Run:
    """A run: a task of a family, a method and a seed."""

    family: str
    task: str
    method: str
    seed: int

    @property
    def name(self) -> str:
        """The name of its folder."""
        return plain("-".join((self.family, self.task, self.method, str(self.seed))))


def plan(family: str, tasks: Sequence[str], methods: Sequence[str] = METHODS) -> list[Run]:
    """Return all runs of some methods or arms in the tasks of a family, first those of seed 0 and so on."""
    return [
        Run(family, task, method, seed)
        for seed in range(SEEDS + 1)
        for n, task in enumerate(tasks)
        if seed < SEEDS or n % EVERY == 0
        for method in methods
    ]


def whole_families(folder: Path) -> list[str]:
    """Return the families in which each planned run has a row; fits are made to no others."""
    predicted = [(row["family"], row["task"]) for row in read_rows(folder / "predictions.csv")]
    done = {Run(row["family"], row["task"], row["method"], int(row["seed"])) for row in read_rows(folder / "runs.csv")}
    families = dict.fromkeys(family for family, _ in predicted)
    return [
        one for one in families if done.issuperset(plan(one, [task for family, task in predicted if family == one]))
    ]


def run_rows(runs: Iterable[Run], folder: Path, processes: int = 1) -> None:
    """Train what has no row in runs.csv, some at a time; refuse a task that was not predicted."""
    predicted = {(row["family"], row["task"]) for row in read_rows(folder / "predictions.csv")}
    planned = [*runs]
    for run in planned:
        if (run.family, run.task) not in predicted:
            raise InputError(f"{run.family} {run.task} has no prediction; predict and commit it before its first run")
    identities = [{name: str(one) for name, one in vars(run).items()} for run in planned]
    add_rows(folder / "runs.csv", identities, partial(in_process, "benchmarks.arena.runs"), processes)


def in_process(*command: str, **identity: str) -> dict[str, Any]:
    """Return the row that a module prints at the end, which runs in a process of its own with words and an identity."""
    done = subprocess.run([sys.executable, "-m", *command, *identity.values()], capture_output=True, text=True)
    if done.returncode < 0 or done.returncode == 130:  # cut off, by a signal or Ctrl-C: no row, so that it goes on
        raise KeyboardInterrupt
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no reason given"])[-1])
    return json.loads(done.stdout.splitlines()[-1])


def train_one(run: Run) -> dict[str, Any]:
    """Train, or go on where the run was cut off, and return its row's numbers."""
    from hierroom.runs.logs.learning_curve import LearningCurve
    from hierroom.worlds.env_config import EnvConfig
    from hierroom.worlds.make import world_spec

    family = FAMILIES[run.family]
    entries = dict(family.tasks()[run.task])
    if run.method == "ppo" and not family.is_ours:
        entries["reward"] = "benchmarks.arena.runs:target_reward"  # others' rewards are of many kinds
    settings: dict[str, Any] = {"steps": family.steps, "seed": run.seed, **ARMS.get(run.method, {"method": run.method})}
    if run.method == NOT_OBSERVED:
        offered = world_spec(EnvConfig.of_arguments(entries)).controller_features
        settings["features"] = tuple(name for name in offered if name not in ("goal", "symbol"))
    settings |= {"evaluations": EVALUATIONS, "evaluation_steps": int(EVALUATED * family.steps)}
    opened = train_or_go_on(KEPT / run.name, **entries, **settings, callback=learned())
    curve = LearningCurve.of_rows(opened.evaluations.read())
    assert curve is not None
    row: dict[str, Any] = {"steps": int(curve.steps[-1]), "first": int(curve.steps[curve.steps > 0][0])}
    for milestone in (50, 95):
        one = curve.crossing(milestone)
        ends = ["", "", ""] if one is None else [f"{steps:.0f}" for steps in (one.steps, one.low, one.high)]
        if one is not None and one.steps == curve.steps[0]:  # at the first look, which may be late
            ends[0] = "0"
        row |= zip((f"steps_to_{milestone}{end}" for end in ("", "_low", "_high")), ends, strict=True)
    return row | {
        "success": float(curve.success[-1]),
        "seconds": round(curve.seconds[-1]),
    }


def train_or_go_on(folder: Path, **entries: Any) -> RunFolder:
    """Train on one thread, or go on where the run in the folder was cut off."""
    import torch

    import hierroom
    from hierroom.runs.folder.run_folder import RunFolder
    from hierroom.train import main

    torch.set_num_threads(1)
    if (folder / "config.json").exists():
        main(["--resume", str(folder), "--trust-run", "--log", "none"])
    else:
        hierroom.train(**entries, threads=1, film=False, out=folder, log="none", quiet=True)
    return RunFolder.open(folder)


def learned() -> Callable[[Trainer], bool]:
    """Return a callback that stops a run which has learned its task."""
    seen: list[Evaluation | None] = [None]

    def stops(trainer: Trainer) -> bool:
        if trainer.evaluation is not seen[-1]:
            seen.append(trainer.evaluation)
        last = seen[-IN_A_ROW:]
        return len(last) == IN_A_ROW and all(one is not None and one.success_rate >= LEARNED for one in last)

    return stops


def target_reward(step: Any) -> Any:
    """Return 1 where the target is reached, as in EscapeRooms: flat PPO learns the task that is predicted."""
    return step.success


target_reward.needs_states = False

if __name__ == "__main__":
    family, task, method, seed = sys.argv[1:]
    print(json.dumps(train_one(Run(family, task, method, int(seed)))))
