"""Predictions of a run: saved by `hierroom advise`, kept in the run's folder, and compared with what came."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import implied_preset
from hierroom.runs.config.run_name import plain
from hierroom.support.errors import InputError
from hierroom.support.files import read_json, to_json, write_atomically

FILE = "advice.json"
"""In the folder of a run: the prediction of its method."""
SCRIPTS = ("fixed-dfs", "none")
"""Meta-controllers of the runs that predict."""


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
        return f"{in_short(self)} [{in_short(self.low)}, {in_short(self.high)}]"


@dataclass(frozen=True)
class Prediction:
    """Hold the steps that one method is expected to need.

    Args:
        method: a name in `agents.config.METHODS`.
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
    steps_to_50: Steps | None = None
    steps_to_95: Steps | None = None
    horizon: int = 0
    chance_to_50: float = math.nan
    chance_to_95: float = math.nan

    @property
    def steps_to(self) -> dict[int, Steps]:
        """The predicted steps by success in percent, of what is predicted."""
        both = {50: self.steps_to_50, 95: self.steps_to_95}
        return {percent: steps for percent, steps in both.items() if steps is not None}

    def to_dict(self) -> dict[str, Any]:
        """Return plain types."""
        return vars(self) | {f"steps_to_{n}": {"value": float(one)} | vars(one) for n, one in self.steps_to.items()}

    def in_words(self) -> str:
        """Return what is predicted."""
        return ", ".join(f"{percent}% after {steps}" for percent, steps in self.steps_to.items()) + " steps"

    def judged(self, measured: Mapping[int, float], end: float) -> str:
        """Return what is predicted next to the measured steps by percent; ``inf`` if it was not reached by the end."""
        parts = []
        for percent, steps in self.steps_to.items():
            took = measured[percent]
            is_outside = took < steps.low or steps.high < min(took, end)
            found = in_short(took) if took < math.inf else f"more than {in_short(end)}"
            parts.append(
                f"{percent}% predicted {steps}, measured {found}{': outside the interval' if is_outside else ''}"
            )
        return "; ".join(parts)


def in_short(steps: float) -> str:
    """Return steps as text with two digits: 45, 1.2k, 210k, 1.2M; ``inf`` as beyond."""
    if math.isinf(steps):
        return "beyond"
    if steps < 995:
        return f"{steps:.0f}"
    unit, letter = (1e3, "k") if steps < 995_000 else (1e6, "M")
    return f"{steps / unit:.{1 if steps / unit < 9.95 else 0}f}{letter}"


def saved_at(key: str) -> Path:
    """Return the file of advice on the environments with a key: see `EnvConfig.key`."""
    return Path("advice", f"{plain(key)[:80]}.json")


def keep_prediction(config: TrainConfig, folder: Path) -> None:
    """Copy what saved advice predicts of a run into its folder: for the same task, limit and method, usual preset."""
    path, key = saved_at(config.env.key), config.env.key
    if not path.is_file():
        return
    task, predictions = _read(path)
    one = predictions.get(config.agents.method)
    is_usual = config.preset == implied_preset({"task": config.env.task}) and config.resolved_method.meta in SCRIPTS
    if one and one.steps_to and task == key and is_usual:
        write_atomically(folder / FILE, to_json({"task": key, "predictions": {one.method: one.to_dict()}}))


def prediction_of(folder: Path) -> Prediction | None:
    """Return what was predicted of a run, or None."""
    path = folder / FILE
    return next(iter(_read(path)[1].values()), None) if path.is_file() else None


def _read(path: Path) -> tuple[str, dict[str, Prediction]]:
    """Return the key and the predictions of a file that anybody may have changed."""

    def steps(saved: Mapping[str, float | None] | None) -> Steps | None:
        if saved is None:
            return None
        low, value, high = (math.inf if (n := saved[name]) is None else float(n) for name in ("low", "value", "high"))
        if not 0 < low <= value <= high:
            raise ValueError
        return Steps(value, low, high)

    table = read_json(path)
    try:
        found = {
            str(method): Prediction(str(one["method"]), steps(one["steps_to_50"]), steps(one["steps_to_95"]))
            for method, one in table["predictions"].items()
        }
        return str(table["task"]), found
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path} is not advice as hierroom writes it; delete it") from error
