"""A search with Optuna: each trial trains the same tasks with the same seeds, and with other values of some entries."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hierroom.lab.sweep.plan import Plan, Values, read_plan
from hierroom.lab.sweep.sweep import Sweep
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.run_lock import RunLock
from hierroom.runs.logs.learning_curve import LearningCurve, evaluation_points
from hierroom.support.errors import InputError, in_one_line, require_number
from hierroom.support.files import refuse_foreign, write_atomically
from hierroom.support.output import duration, warn
from hierroom.support.tables import csv_text

if TYPE_CHECKING:
    from optuna import Study, Trial  # pyright: ignore[reportMissingImports] - an extra

    from hierroom.lab.sweep.job import Event

FIRST_SEED = 10**6
"""The first seed of a search; ``--seeds`` of a sweep, which tests what was found, ends before it."""
_PLAYED = ("task", "graph", "layout")  # each trial trains on all of their values
WARMUP = 1 / 4
"""No trial is pruned before this share of its steps."""
_EPISODES = 100  # of the evaluations at the end, which do not count
_SECONDS = 1.0  # between two looks at the learning curves
Reference = tuple[float, float] | None
"""Of a run whose return counts, in the first trial: the return before training, and the range of returns later."""


@dataclass(frozen=True)
class Search:
    """A search, in a folder with ``study.db``, ``trials.csv`` and the sweep of all its runs.

    The first trial has the values of the preset, as near as the space allows. Later ones follow from those before them,
    trial by trial, so that neither kills nor the number of processes change them.
    """

    plan: Plan  # what all trials have in common
    space: Values  # the values of each entry to choose from, or the two ends of its range
    ranges: frozenset[str]  # the entries with a range
    out: Path

    @classmethod
    def read(cls, path: Path | None, words: Sequence[str], out: Path, **settings: Any) -> Search:
        """Return the search of a sweep's file and words; a word may also have a range, ``entry=LOW..HIGH``."""
        try:
            import optuna  # noqa: F401  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise InputError("--search needs Optuna: pip install 'hierroom[search]'") from error
        listed = {word: _without_range(word) for word in words}
        ranges = {word.partition("=")[0].replace("-", "_") for word, plain in listed.items() if plain != word}
        plan = replace(read_plan(path, [*listed.values()]), **settings)
        if "seed" in plan.values or plan.variants:
            raise InputError(f"a search has seeds from {FIRST_SEED} on, as many as --seeds says, and no variants")
        space = {name: values for name, values in plan.values.items() if len(values) > 1 and name not in _PLAYED}
        if not space:
            raise InputError("say what to search: entries with a range, such as gamma=0.9..0.999, or several values")
        seeds = [FIRST_SEED + n for n in range(plan.seeds or 1)]
        fixed = {"seed": seeds, **{name: values for name, values in plan.values.items() if name not in space}}
        plan = replace(plan, values=fixed, seeds=None, episodes=plan.episodes or _EPISODES)
        return cls(plan, space, frozenset(ranges), out)

    def fill(self, trials: int, say: Callable[[str], object], **how: Any) -> bool:
        """Do the missing trials, each as `Sweep.fill` does it; return whether this was interrupted."""
        require_number("search", trials, 1, 10**6, is_whole=True)
        first = self.plan_of(0, self.values(self.preset()))
        Sweep(first, self.out).check(first.runs(), how.get("processes"))
        if not all(run.config.evaluations for run in first.runs()):
            raise InputError("a search compares learning curves, so evaluations must be at least 1, not 0")
        self.out.mkdir(parents=True, exist_ok=True)
        with RunLock(self.out, ".search.lock"):
            study, began = self.study(), time.monotonic()
            n_before = n_ended = sum(trial.state.is_finished() for trial in study.trials)
            while n_ended < trials:
                if self._do(study, n_ended, how):
                    return True
                n_ended += 1
                write_atomically(self.out / "trials.csv", csv_text(rows := self.rows()))
                left = duration((time.monotonic() - began) / (n_ended - n_before) * (trials - n_ended))
                state = "trial {trial} {state} {score}".format(**rows[-1]).rstrip()
                say(f"{state}; {n_ended} of {trials} trials are done, about {left} left")
        return False

    def study(self) -> Study:
        """Return the stored study; if there is none, begin it."""
        import optuna  # pyright: ignore[reportMissingImports]

        optuna.logging.set_verbosity(optuna.logging.ERROR)
        refuse_foreign(changed=[path := self.out / "study.db"])
        try:
            study = optuna.create_study(
                storage=f"sqlite:///{path}", study_name="search", direction="maximize", load_if_exists=True
            )
        except Exception as error:  # of SQLAlchemy, of many types
            raise InputError(f"{path} is no study of a search: {in_one_line(error)}") from error
        asked = str(self.plan) + str(self.space) + str(sorted(self.ranges))
        if study.user_attrs.get("asked", asked) != asked:
            raise InputError(f"{self.out} has a search of other tasks, entries or ranges; choose another --out")
        if not study.trials:
            study.set_user_attr("asked", asked)
            study.enqueue_trial(self.preset())
        return study

    def rows(self) -> list[dict[str, Any]]:
        """Return the number, state, score and entries of each trial; only complete ones have a score."""
        rows = []
        for trial in self.study().trials:
            state = trial.state.name.lower()
            score = round(trial.value, 6) if state == "complete" and trial.value is not None else ""
            rows.append({"trial": trial.number, "state": state, "score": score, **self.values(trial.params)})
        return rows

    def plan_of(self, number: int, values: Mapping[str, Any]) -> Plan:
        """Return the runs of a trial."""
        return replace(self.plan, variants={f"trial {number}": {name: [value] for name, value in values.items()}})

    def values(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Return the entries of a trial's parameters; numbers of a range have five digits."""
        return {name: self._value(name, one) for name, one in params.items()}

    def _value(self, name: str, given: Any) -> Any:
        if name not in self.ranges:
            return next(value for value in self.space[name] if str(value) == given)
        return float(f"{given:.5g}") if isinstance(given, float) else given

    def preset(self) -> dict[str, Any]:
        """Return the parameters of the first trial."""
        entries, params = self.plan.runs()[0].config.entries, {}
        for name, values in self.space.items():
            if name not in self.ranges:
                params[name] = str(entries[name] if entries[name] in values else values[0])
            else:
                params[name] = values[0] if entries[name] is None else min(max(entries[name], values[0]), values[1])
        return params

    def _suggest(self, trial: Trial) -> Trial:
        for name, values in self.space.items():
            if name in self.ranges:
                suggest = trial.suggest_int if isinstance(values[0], int) else trial.suggest_float
                suggest(name, *values, log=0 < values[0] <= values[1] / 10)
            else:
                trial.suggest_categorical(name, [*map(str, values)])
        return trial

    def _do(self, study: Study, number: int, how: Mapping[str, Any]) -> bool:
        """Do a trial or the rest of it; return whether it was interrupted."""
        from optuna.pruners import MedianPruner  # pyright: ignore[reportMissingImports]
        from optuna.samplers import TPESampler  # pyright: ignore[reportMissingImports]
        from optuna.trial import Trial, TrialState  # pyright: ignore[reportMissingImports]

        study.sampler = TPESampler(seed=number)  # of each trial, as a continued search could not go on with one of all
        begun = [one for one in study.trials if one.state == TrialState.RUNNING]
        trial = self._suggest(Trial(study, begun[0]._trial_id) if begun else study.ask())
        plan = self.plan_of(number, self.values(trial.params))
        folders, references = [self.out / "runs" / run.name for run in plan.runs()], study.user_attrs.get("references")
        points = evaluation_points((config := plan.runs()[0].config).steps, config.evaluations)[1:]
        ends = [config.steps * n + point for n in range(len(folders)) for point in points]
        study.pruner = MedianPruner(n_warmup_steps=sum(end < WARMUP * ends[-1] for end in ends))
        n_reported, looked, is_bad = len(study.trials[number].intermediate_values), 0.0, trial.should_prune()

        def watch(event: Event | None) -> bool:
            nonlocal n_reported, looked, is_bad
            if references is not None and (event is None or time.monotonic() > looked + _SECONDS):
                for score in scores_so_far(folders, points, references)[n_reported:] if not is_bad else ():
                    trial.report(score, n_reported)
                    n_reported += 1
                    if is_bad := n_reported < len(ends) and trial.should_prune():
                        break
                looked = time.monotonic()
            return is_bad

        state, score = TrialState.FAIL, None
        try:
            outcome = Sweep(plan, self.out).fill(watch=watch, **how)
        except InputError as error:  # entries that do not go together
            warn(f"trial {number} failed: {error}")
        else:
            if outcome.is_interrupted:
                return True
            references = references or [reference_of(folder) for folder in folders]
            if watch(None):
                state = TrialState.PRUNED
            elif len(scores := scores_so_far(folders, points, references)) == len(ends):  # else a run has failed
                state, score = TrialState.COMPLETE, scores[-1]
                study.set_user_attr("references", references)
        study.tell(trial, score, state)
        return False


def _without_range(word: str) -> str:
    """Return ``entry=LOW,HIGH`` for a word with a range of numbers, ``entry=LOW..HIGH``, and other words as given."""
    name, _, text = word.partition("=")
    low, dots, high = text.partition("..")
    try:
        return f"{name}={low},{high}" if dots and float(low) < float(high) < float("inf") else word
    except ValueError:  # such as a path
        return word


def reference_of(folder: Path) -> Reference:
    """Return the reference of a run, None if it has a success rate or a score."""
    curve = _curve(folder)
    return None if curve is None or curve.is_rate else (float(curve.returns[0]), float(np.ptp(curve.returns)))


def scores_so_far(folders: Sequence[Path], points: Sequence[int], references: Sequence[Reference]) -> list[float]:
    """Return the score of a trial at points of its runs in order, up to the first one that is not evaluated yet.

    A run's score is its mean success rate, or score over goals, over its steps, where those to come count as 0. If its
    return counts, it is ``gain / (gain + range)``. The gain is its mean return over the steps, above the reference's
    return before training; the range is that of the reference's returns. A negative gain counts as 0.

    Args:
        folders: those of the R runs.
        points: P steps of a run at which it is evaluated, the last one at its end.
        references: those of the R runs.
    """
    scores = []
    for n, (folder, reference) in enumerate(zip(folders, references, strict=True)):
        before, curve = scores[-1] if n else 0.0, _curve(folder)
        low, scale = reference or (0.0, 0.0)
        for point in points:
            if curve is None or curve.steps[-1] < point:
                return scores
            x = np.append(curve.steps[curve.steps < point], point)
            gain = max(0.0, float(np.trapezoid(np.interp(x, curve.steps, curve.outcome) - low, x)) / points[-1])
            score = gain / (gain + scale) if reference and gain else gain
            scores.append(before + score / len(folders))
    return scores


def _curve(folder: Path) -> LearningCurve | None:
    return LearningCurve.of_rows(RunFolder(folder).evaluations.read())
