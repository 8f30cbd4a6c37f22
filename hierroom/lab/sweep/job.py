"""One run of a sweep: it is trained or resumed, evaluated at its end, and summarised in a row."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from rich.console import Console

from hierroom.agents.evaluation import Evaluation
from hierroom.complexity.graph_set import GraphSet
from hierroom.lab.sweep.plan import PlannedRun
from hierroom.runs.folder.provenance import changed_modules, version_of_code
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.run_lock import RunLock, RunLockedError
from hierroom.runs.folder.user_code import find_module_files, user_code_digest
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve
from hierroom.runs.results import write_results
from hierroom.runs.session import begin, resume, train
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import CheckpointError, InputError
from hierroom.support.interrupt import Interrupt
from hierroom.support.output import lasting_output

MAX_TRIES = 3  # tries of a run, if its process is killed or stopped
MOST_EPISODES, FEWEST_EPISODES = 1000, 100  # of an evaluation at the end, unless the plan sets the number
SHARE_OF_STEPS = 1 / 4  # steps of all evaluations at the end, as a share of training's, unless episodes are too few
_loaded_files: dict[str, str | None] = {}  # digests of custom code when this process loaded it; it is not reloaded


@dataclass(frozen=True)
class Job:
    """A run to train in a folder; if the folder has a part of the run, it is resumed.

    Its evaluations at the end play as many episodes as the plan sets. Without a number in the plan, each plays 1000, or
    as many as take a quarter of the steps of training together, but at least 100. No clock influences this number.
    """

    run: PlannedRun
    folder: Path
    episodes: int | None  # number of episodes of each evaluation at the end
    metas: tuple[str, ...]  # other meta-controllers to evaluate the trained controller with, if it sees goals
    command: str  # the command that began the sweep

    def work(self, report: Callable[[int, str], object]) -> dict[str, object] | None:
        """Train and evaluate, and report steps and a status; return the row's results, None if interrupted and saved.

        It raises a `RunLockedError` if another process trains the run.
        """
        torch.set_num_threads(1)  # processes run in parallel instead
        config = self.run.config
        self.check_folder()
        for file in find_module_files(config, self.metas):
            if _loaded_files.setdefault(file.name, file.digest) != file.digest:
                raise InputError(f"{file.name} changed while the sweep went on; begin the sweep again to load it anew")
        user_code, variant = user_code_digest(config, self.metas), self.run.identity["variant"]
        if (self.folder / "config.json").is_file():
            if changes := changed_modules(self.folder, config):
                raise InputError(f"{changes[0]}; move {self.folder} away to train this run with the code as it is now")
            try:
                trainer, folder = resume(config, self.folder, variant)
            except CheckpointError as error:
                raise InputError(f"{error}; move {self.folder} away to train this run from its beginning") from error
        else:
            try:
                trainer, folder = begin(config, self.folder, variant)
            except InputError as error:
                has_begun = (self.folder / "config.json").is_file()  # in another process, meanwhile
                if has_begun or (self.folder.is_dir() and RunLock(self.folder).is_held):
                    raise RunLockedError(str(error)) from error
                raise
        with folder.lock, lasting_output(), closing(trainer.turns.world), Interrupt(hears_ctrl_c=False) as interrupt:
            train(trainer, folder, interrupt, lambda words: report(trainer.steps, words))
            if not trainer.is_done:
                return None
            write_results(trainer, folder, Console(file=io.StringIO()))
            return self._numbers(trainer, folder) | {"own_code": user_code}

    def check_folder(self) -> None:
        """Refuse a folder that holds another run."""
        if not (self.folder / "config.json").is_file():
            return
        if differences := RunFolder.open(self.folder).config().differences(self.run.config):
            raise InputError(f"{self.folder} holds another run: {', '.join(differences)}; move it away")

    def _numbers(self, trainer: Trainer, folder: RunFolder) -> dict[str, object]:
        summary = trainer.summary()
        numbers: dict[str, object] = {name: summary[name] for name in ("steps", "episodes", "seconds")}
        numbers["steps_per_second"] = round(summary["steps_per_second"])
        curve = LearningCurve.of_rows(folder.evaluations.read())
        if curve is not None:
            for milestone in MILESTONES:
                one = curve.crossing(milestone)
                ends = (None, None, None) if one is None else (round(one.steps), round(one.low), one.high)
                names = (f"steps_to_{milestone}{end}" for end in ("", "_low", "_high"))
                numbers |= zip(names, ends, strict=True)
            numbers["area_under_curve"] = curve.area
        kinds: dict[str, dict[str, Any]] = {"": {}, "greedy_": {"is_greedy": True}}
        for meta in self.metas if trainer.config.resolved_method.sees_goal else ():
            kinds[f"{meta}_"] = {"meta": meta}
        env = trainer.config.env
        if env.exclude and (excluded := GraphSet(env.graph, env.exclude, env.drop_key).excluded):
            kinds["excluded_"] = {"graph": excluded}
        steps = trainer.steps * SHARE_OF_STEPS / len(kinds)
        evaluations = {prefix: self._evaluate(trainer, steps, kind) for prefix, kind in kinds.items()}
        for prefix, evaluation in evaluations.items():
            columns = {**evaluation.columns, "evaluated_episodes": evaluation.episodes}
            numbers |= {f"{prefix}{name}": value for name, value in columns.items()}
        return numbers | evaluations[""].goal_columns | {"version": version_of_code(), "command": self.command}

    def _evaluate(self, trainer: Trainer, steps: float, kind: dict[str, Any]) -> Evaluation:
        if self.episodes is not None:
            return trainer.evaluate(self.episodes, **kind)
        if (most := trainer.config.evaluation_steps) is not None:  # of a user's task that is slow
            steps, length = steps * most / (2 * SHARE_OF_STEPS * trainer.steps), trainer.log.means["episode_length"]
            return trainer.evaluate(max(1, min(FEWEST_EPISODES, int(np.nan_to_num(steps / length)))), **kind)
        few = trainer.evaluate(FEWEST_EPISODES, **kind)  # a second evaluation starts with the same episodes
        rounds = int(steps / few.length / FEWEST_EPISODES)
        return few if rounds <= 1 else trainer.evaluate(min(rounds * FEWEST_EPISODES, MOST_EPISODES), **kind)


class Event(NamedTuple):
    """An event of a job: it is retried from a checkpoint if only its process was stopped, interrupted if the sweep was.

    It is unsaved if its process did not stop in time, busy if another sweep does it at this time, and done elsewhere if
    another sweep has added its row.
    """

    kind: Literal["progressed", "finished", "failed", "retried", "interrupted", "unsaved", "busy", "done elsewhere"]
    job: Job
    content: Any = None  # steps so far and a status, the results for the row, or the reason of a failure
