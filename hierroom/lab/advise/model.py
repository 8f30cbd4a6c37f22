"""The model of training steps: log-normal around a power of a measure, from a small data file in the package.

    log T = a + b log m + s e,    e standard normal

T are primitive training steps to a milestone, m the measure. Slope b, intercept a and s are fitted to runs, of which
some did not get there, by `python -m benchmarks.prediction`. The 90% interval is from T low to T high, with the two
factors that 5% of the runs were below, and 5% above, in tasks that the fit had not seen.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from scipy.special import ndtr

from hierroom.support.files import read_text

FILE = Path(__file__).with_name("model.json")
Z90 = 1.6448536269514722
"""Half of the standard normal distribution's central 90% interval."""


@dataclass(frozen=True)
class Fit:
    """The steps of one method to one milestone in one world.

    Args:
        method: a name in `agents.config.METHODS`.
        milestone: ``steps_to_50`` or ``steps_to_95``.
        world: ``escape_room``, ``workshop`` or ``other``: see `outside`.
        measure: a name in `measures.MEASURES`.
        intercept: a.
        slope: b.
        sigma: s.
        low: factor from the median to the interval's lower end.
        high: factor to its upper end; ``inf`` if more than 5% of the runs never got there.
        tasks: number of tasks whose runs were fitted.
        runs: number of these runs.
    """

    method: str
    milestone: str
    world: str
    measure: str
    intercept: float
    slope: float
    sigma: float
    low: float
    high: float
    tasks: int
    runs: int

    def median(self, measure: float) -> float:
        """Return the median steps, given the measure."""
        return math.exp(self.intercept + self.slope * math.log(measure))

    def chance(self, measure: float, steps: float) -> float:
        """Return the chance to get there within some steps; the spread is at least that of the interval's lower end."""
        return float(ndtr(math.log(steps / self.median(measure)) / max(self.sigma, -math.log(self.low) / Z90)))


@dataclass(frozen=True)
class Model:
    """All fits, and what they were made from.

    Args:
        name: version and digest.
        worlds: number of worlds that the fits to all of them have.
        horizon: steps of the runs; what is expected later is ``inf``.
        bounds: smallest and largest value of what `outside` asks, among the tasks of the runs.
        fits: by method, milestone and world.
        tasks: by name, the measure of HiPPO's steps to 50% success and the median of them; ``inf``: never.
    """

    name: str
    worlds: int
    horizon: int
    bounds: Mapping[str, tuple[float, float]]
    fits: Mapping[tuple[str, str, str], Fit]
    tasks: Mapping[str, tuple[float, float]]


@cache
def read_model(path: Path = FILE) -> Model:
    """Return the model of a file."""
    text = read_text(path)
    table = json.loads(text)
    digest = hashlib.sha256(text.encode()).hexdigest()[:12]
    fits = [Fit(**row) for row in table["fits"]]
    bounds = {name: (float(low), float(high)) for name, (low, high) in table["bounds"].items()}
    by_key = {(fit.method, fit.milestone, fit.world): fit for fit in fits}
    tasks = {name: (measure, math.inf if steps is None else steps) for name, (measure, steps) in table["tasks"].items()}
    return Model(f"{table['version']} {digest}", table["worlds"], table["horizon"], bounds, by_key, tasks)
