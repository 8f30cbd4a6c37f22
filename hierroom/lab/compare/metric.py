"""What runs are compared by: columns of their ``evaluations.csv``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

MetricName = Literal["success_rate", "return", "length", "length_over_shortest"]


@dataclass(frozen=True)
class Metric:
    """A column of ``evaluations.csv``."""

    label: str  # what it is called in tables and figures
    is_higher_better: bool = True  # whether more of it is an improvement
    is_rate: bool = False  # whether it is a fraction, which is shown in percent
    digits: int = 1  # how many of them are shown after the point

    @property
    def axis_label(self) -> str:
        """Label with unit."""
        return f"{self.label} (%)" if self.is_rate else self.label

    @property
    def scale(self) -> float:
        """What a value is multiplied by to be shown."""
        return 100.0 if self.is_rate else 1.0


METRICS: Mapping[MetricName, Metric] = {
    "success_rate": Metric("success rate", is_rate=True),
    "return": Metric("return of the controller", digits=2),
    "length": Metric("episode length (steps)", is_higher_better=False),
    "length_over_shortest": Metric("length / shortest", is_higher_better=False, digits=2),
}
