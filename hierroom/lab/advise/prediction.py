"""Predicted training steps with intervals, and the advice that follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from hierroom.lab.advise.costs import PlayCosts
from hierroom.lab.advise.measures import MEASURES, Known
from hierroom.lab.advise.model import Model
from hierroom.lab.advise.outside import OTHER, outside
from hierroom.lab.advise.rule_check import RuleCheck
from hierroom.support.intervals import Interval

NAMES = {"hippo": "HiPPO (script)", "ppo-bonus": "PPO+Bonus", "ppo": "PPO"}


class Steps(float):
    """Training steps: the median of what is predicted, with its own 90% interval; ``inf``: beyond the horizon."""

    low: float
    high: float

    def __new__(cls, value: float, low: float, high: float) -> Self:
        """Return steps with 0 < low <= value <= high."""
        steps = super().__new__(cls, value)
        steps.low, steps.high = low, high
        return steps

    @classmethod
    def within(cls, median: float, low: float, high: float, horizon: float) -> Self:
        """Return the median and the interval as far as a horizon; ``low`` and ``high`` are factors of the median."""
        value, top = (one if one <= horizon else math.inf for one in (median, median * high))
        return cls(value, min(median * low, horizon), top)

    def __str__(self) -> str:
        if self.low == self.high or (math.isinf(self) and math.isinf(self.high)):
            return f"more than {in_short(self.low)}"
        return _interval(Interval(self, self.low, self.high))


@dataclass(frozen=True)
class Prediction:
    """Hold the steps that one method is expected to need.

    Args:
        method: a name in `agents.config.METHODS`.
        preset: the preset of the runs that the model was fitted to.
        steps_to_50: steps to 50% success; None if this is not predicted.
        steps_to_95: steps to 95% success; None if this is not predicted.
        horizon: steps of the runs that the model was fitted to.
        chance_to_50: chance to reach 50% within the horizon; ``nan`` if this is not predicted.
        chance_to_95: chance to reach 95% within the horizon; ``nan`` if this is not predicted.

    Examples:
        >>> steps = hierroom.advise(graph="a", play_steps=200_000).predictions["hippo"].steps_to_50
        >>> 0 < steps.low <= steps <= steps.high
        True
    """

    method: str
    preset: str
    steps_to_50: Steps | None = None
    steps_to_95: Steps | None = None
    horizon: int = 0
    chance_to_50: float = math.nan
    chance_to_95: float = math.nan


@dataclass(frozen=True)
class Advice:
    """Hold what follows from rules and a little random play, before anybody trains; made by `hierroom.advise`.

    Args:
        name: the task's name.
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

    @property
    def random_success(self) -> Interval | None:
        """Share of episodes in which random play reaches the target."""
        return None if self.costs is None else self.costs.random_success

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain types."""

        def plain(steps: Steps | None) -> dict[str, float] | None:
            return None if steps is None else {"value": float(steps), "low": steps.low, "high": steps.high}

        costs = self.costs
        return {
            "task": self.name,
            "predictions": {
                name: vars(one) | {"steps_to_50": plain(one.steps_to_50), "steps_to_95": plain(one.steps_to_95)}
                for name, one in self.predictions.items()
            },
            "costs": costs and {name: vars(goal) for name, goal in costs.goals.items()},
            "expected_steps": costs and costs.expected_steps,
            "random_success": self.random_success,
            "rules": self.rules and self.rules.to_dict(),
            **{name: getattr(self, name) for name in ("method", "steps", "outside", "reason", "model")},
            "chain": dict(self.chain),
        }

    def __str__(self) -> str:
        lines = [self._head(), *self._of_play()]
        if self.rules is not None:
            lines += [_row("rules", text) for text in str(self.rules).splitlines()]
        if self.chain:
            lines.append(_row("chain", ", ".join(f"{name} {_plain(value)}" for name, value in self.chain.items())))
        if self.predictions:
            lines.append(f"{'method':<16} {'steps to 50%':<26} to 95%")
        for name, one in self.predictions.items():
            times = ["not predicted" if steps is None else str(steps) for steps in (one.steps_to_50, one.steps_to_95)]
            lines.append(f"{NAMES.get(name, name):<16} {times[0]:<26} {times[1]}")
        if self.reason is not None:
            lines.append(_row("outside" if self.outside else "note", self.reason))
        if self.method is not None:
            command = f"python -m hierroom train {self.train} --steps {self.steps:_}"
            command += "" if self.method == "hippo" else f" --method {self.method}"
            lines.append(_row("advice", f"{NAMES[self.method]}, {self.steps:,} steps:  {command}"))
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
    return f"{in_short(steps.value)} [{in_short(steps.low)}, {in_short(steps.high)}]"


def _plain(value: Any) -> str:
    return f"{value:,.0f}" if isinstance(value, (int, float)) else str(value)


def _row(name: str, text: str) -> str:
    return f"{name:<16} {text}"


def in_short(steps: float) -> str:
    """Return steps as text with two digits: 45, 1.2k, 210k, 1.2M; ``inf`` as beyond."""
    if math.isinf(steps):
        return "beyond"
    if steps < 995:
        return f"{steps:.0f}"
    unit, letter = (1e3, "k") if steps < 995_000 else (1e6, "M")
    return f"{steps / unit:.{1 if steps / unit < 9.95 else 0}f}{letter}"


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
        if reason := outside(known, measure, model.bounds):
            return {}, reason
        one = found.get(method, Prediction(method, model.preset, horizon=model.horizon))
        steps = Steps.within(fit.median(measure), fit.low, fit.high, model.horizon)
        changes: Any = {milestone: steps, milestone.replace("steps", "chance"): fit.chance(measure, model.horizon)}
        found[method] = replace(one, **changes)
    return found, None


def best_of(predictions: Mapping[str, Prediction]) -> tuple[str | None, int | None]:
    """Return the method that is expected to reach 50% first, and steps that suffice for 95%, with two digits.

    None if every method is expected to take longer than the horizon.
    """
    times = {name: one.steps_to_50 for name, one in predictions.items() if one.steps_to_50 is not None}
    name = min(times, key=times.__getitem__, default=None)
    if name is None or math.isinf(times[name]):
        return None, None
    one = predictions[name]
    enough = (one.steps_to_95 or times[name]).high
    steps = min(enough, one.horizon)
    digits = 10 ** (len(str(int(steps))) - 2)
    return name, int(math.ceil(steps / digits) * digits)
