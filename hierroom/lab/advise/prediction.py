"""Predicted training steps with intervals, and the advice that follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hierroom.lab.advise.costs import PlayCosts
from hierroom.lab.advise.measures import MEASURES, Known
from hierroom.lab.advise.model import Model
from hierroom.lab.advise.outside import OTHER, outside
from hierroom.lab.advise.rule_check import RuleCheck
from hierroom.runs.folder.predicted import Prediction, Steps, in_short, saved_at
from hierroom.support.errors import InputError
from hierroom.support.files import to_json, write_atomically
from hierroom.support.intervals import Interval
from hierroom.support.output import duration

NAMES = {"hippo": "HiPPO (script)", "ppo-bonus": "PPO+Bonus", "ppo": "PPO"}


@dataclass(frozen=True)
class Advice:
    """Hold what follows from rules and a little random play, before anybody trains; made by `hierroom.advise`.

    Args:
        name: the task's name, with the size and the limit if they are not the usual ones: `EnvConfig.key`.
        train: the words after ``train`` that name the task on the command line.
        predictions: by method; empty if the task lies outside of what was measured.
        costs: what goals cost in random play; None without play.
        rules: how the rules agree with play; None if there are none to compare.
        method: the method to try first, or None.
        steps: the steps to train it.
        outside: whether the task lies outside of what was measured.
        reason: why there are no predictions, or what is uncertain about them; None if nothing is.
        model: version and digest of the model.
        chain: depth, fewest goals and the like, from the rules; empty without rules.
        training_speed: steps a second of training here; None if it was not measured.
        similar: tasks of the model's runs that are nearest by its measure, and the median steps of HiPPO to 50% there.

    Examples:
        >>> hierroom.advise(graph="a", play_steps=200_000).method
        'hippo'
    """

    name: str
    train: str
    predictions: Mapping[str, Prediction]
    costs: PlayCosts | None
    rules: RuleCheck | None
    method: str | None
    steps: int | None
    outside: bool
    reason: str | None
    model: str
    chain: Mapping[str, Any]
    training_speed: float | None = None
    similar: Sequence[tuple[str, float]] = ()

    @property
    def random_success(self) -> Interval | None:
        """Share of episodes in which random play reaches the target."""
        return None if self.costs is None else self.costs.random_success

    def save(self) -> Path:
        """Write everything into ``advice/``, where a run of the task finds what was predicted of it."""
        path = saved_at(self.name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, to_json(self.to_dict()))
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror}") from error
        return path

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain types."""
        costs = self.costs
        return {
            "task": self.name,
            "predictions": {name: one.to_dict() for name, one in self.predictions.items()},
            "costs": costs and {name: vars(goal) for name, goal in costs.goals.items()},
            "expected_steps": costs and costs.expected_steps,
            "play_steps": costs and costs.steps,
            "episodes": costs and costs.episodes,
            "random_success": self.random_success,
            "rules": self.rules and self.rules.to_dict(),
            **{name: getattr(self, name) for name in ("method", "steps", "outside", "reason", "model")},
            "chain": dict(self.chain),
            "training_speed": self.training_speed,
            "similar": dict(self.similar),
        }

    def __str__(self) -> str:
        lines = [self._head(), *self._of_play()]
        if self.rules is not None:
            lines += [_row("rules", text) for text in str(self.rules).splitlines()]
        if self.chain:
            lines.append(_row("chain", ", ".join(f"{name} {_plain(value)}" for name, value in self.chain.items())))
        if self.predictions:
            lines.append(_row("method", f"{'steps to 50%':<22} {'to 95%':<22} here"))
        for name, one in self.predictions.items():
            times = ["not predicted" if steps is None else str(steps) for steps in (one.steps_to_50, one.steps_to_95)]
            most = max(one.steps_to.values(), default=math.inf)
            here = "-" if self.training_speed is None or math.isinf(most) else duration(most / self.training_speed)
            lines.append(_row(NAMES.get(name, name), f"{times[0]:<22} {times[1]:<22} {here}"))
        if self.reason is not None:
            lines.append(_row("outside" if self.outside else "note", self.reason))
        if self.method is not None:
            command = f"python -m hierroom train {self.train} --steps {self.steps:_}"
            command += "" if self.method == "hippo" else f" --method {self.method}"
            one = self.predictions[self.method]
            *_, last = one.steps_to.values()
            twice = ", twice the median" if math.isinf(last.high) and (self.steps or 0) < one.horizon else ""
            lines.append(_row("advice", f"{NAMES[self.method]}, {self.steps:,} steps{twice}:  {command}"))
        if self.similar:
            lines.append(_row("similar tasks", ", ".join(f"{name} ({in_short(one)})" for name, one in self.similar)))
        return "\n".join(lines)

    def _head(self) -> str:
        costs = self.costs
        if costs is None:
            return f"{self.name}: rules alone"
        ended = ", interrupted" if costs.is_interrupted else ""
        speed = f"{costs.steps_per_second:,.0f} steps a second here"
        played = f"{in_short(costs.steps)} steps of random play{ended}"
        return f"{self.name}: {played}, {speed}, episodes of {costs.limit:,} steps"

    def _of_play(self) -> list[str]:
        costs = self.costs
        if costs is None:
            return []
        lines, success, total = [], costs.random_success, costs.expected_steps
        if costs.episodes:
            n, chance = round(success.value * costs.episodes), f"{success.low:.1%} to {success.high:.1%}"
            lines.append(_row("random play", f"succeeds in {n} of {costs.episodes:,} episodes ({chance})"))
        for name, goal in costs.goals.items():
            if math.isinf(goal.steps.value):
                lines.append(_row("not reached", f"{name}, in {goal.pursued:,} steps that pursued it"))
        if math.isfinite(total.value):
            lines.append(_row("random steps", f"{_interval(total)} to the target"))
            hardest = costs.goals[str(costs.hardest)]
            text = f"{costs.hardest}, {hardest.share:.0%} of the expected steps, {_interval(hardest.steps)} each time"
            lines.append(_row("hardest goal", text))
        return lines


def _interval(steps: Interval) -> str:
    return str(Steps(*steps))


def _plain(value: Any) -> str:
    return f"{value:,.0f}" if isinstance(value, (int, float)) else str(value)


def _row(name: str, text: str) -> str:
    return f"{name:<16} {text}"


def predict(known: Known, world: str, model: Model) -> tuple[dict[str, Prediction], str | None]:
    """Return the predictions of each method, or none and why: see `outside`.

    Args:
        known: what play and rules showed.
        world: see `outside.world_of`.
        model: the fits.
    """
    found: dict[str, Prediction] = {}
    for method, milestone in dict.fromkeys((method, milestone) for method, milestone, _ in model.fits):
        fit = model.fits.get((method, milestone, world)) or model.fits[method, milestone, OTHER]
        measure = MEASURES[fit.measure](known)
        one = found.setdefault(method, Prediction(method, horizon=model.horizon))
        if reason := outside(known, measure, model.bounds):
            return {}, reason
        steps = Steps.within(fit.median(measure), fit.low, fit.high, model.horizon)
        changes: Any = {milestone: steps, milestone.replace("steps", "chance"): fit.chance(measure, model.horizon)}
        found[method] = replace(one, **changes)
    return found, None


def similar(known: Known, model: Model, n: int = 3) -> list[tuple[str, float]]:
    """Return the tasks of the model's runs that are nearest by the measure of HiPPO's steps, and its steps to 50%."""
    measure = math.log(MEASURES[model.fits["hippo", "steps_to_50", OTHER].measure](known))
    nearest = sorted(model.tasks, key=lambda name: abs(math.log(model.tasks[name][0]) - measure))
    return [(name, model.tasks[name][1]) for name in nearest[:n]]


def best_of(predictions: Mapping[str, Prediction]) -> tuple[str | None, int | None]:
    """Return the method that is expected to reach 50% first, and steps that suffice for 95%, with two digits.

    They are the interval's end, or twice the median if that end is beyond the horizon, but at most the horizon. None
    if every method is expected to take longer than the horizon.
    """
    times = {name: one.steps_to_50 for name, one in predictions.items() if one.steps_to_50 is not None}
    name = min(times, key=times.__getitem__, default=None)
    if name is None or math.isinf(times[name]):
        return None, None
    one = predictions[name]
    *_, last = one.steps_to.values()
    steps = round(min(2 * last if math.isinf(last.high) else last.high, one.horizon))
    digits = 10 ** (len(str(steps)) - 2)
    return name, int(math.ceil(steps / digits) * digits)
