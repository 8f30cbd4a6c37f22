"""The numbers that the paper prints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class PaperColumn:
    """The values that the paper's Table 2 prints for one graph."""

    exit_depth: int
    width: int
    hitting_time: float
    hitting_time_drop: float


PAPER_TABLE_2: Mapping[str, PaperColumn] = {
    "a": PaperColumn(2, 1, 8.4, 16.5),
    "b": PaperColumn(2, 2, 12.1, 25.2),
    "c": PaperColumn(4, 1, 15.1, 39.5),
    "d": PaperColumn(2, 2, 13.1, 27.5),
    "e": PaperColumn(2, 3, 13.9, 26.7),
    "f": PaperColumn(4, 2, 29.2, 86.1),
    "g": PaperColumn(6, 1, 27.5, 82.5),
}

# Our names for the paper's methods, and the paper's names, in the order of its Table 3.
METHODS: Mapping[str, str] = {"ppo": "PPO", "ppo-bonus": "PPO+Bonus", "ppo-sketch": "PPO+Sketch", "hippo": "HiPPO"}
_SUCCESS = {
    "ppo": (56.1, 28.2, 0.2, 22.7, 19.1, 0.0, 0.0),
    "ppo-bonus": (9.0, 6.0, 0.0, 11.0, 4.5, 0.5, 0.0),
    "ppo-sketch": (23.2, 14.5, 0.4, 12.6, 10.7, 0.1, 0.0),
    "hippo": (74.9, 57.0, 60.8, 48.0, 29.9, 11.2, 19.0),
}
_LENGTH = {
    "ppo": (78.5, 88.0, None, 90.7, 91.4, None, None),
    "ppo-bonus": (97.8, 96.7, 99.9, 97.3, 98.0, 99.9, None),
    "ppo-sketch": (91.9, 94.4, 99.9, 95.0, 95.7, None, None),
    "hippo": (48.2, 67.4, 69.1, 71.0, 85.3, 96.4, 93.8),
}


@dataclass(frozen=True)
class PaperCell:
    """One method on one graph in the paper's Table 3: means over the last 10 episodes of five seeds."""

    success: float  # percent
    length: float | None  # percent of 1000 steps; None for a dash (about 100%), which goes with at most 0.5% success


PAPER_TABLE_3: Mapping[tuple[str, str], PaperCell] = {
    (method, graph): PaperCell(_SUCCESS[method][n], _LENGTH[method][n])
    for method in METHODS
    for n, graph in enumerate("abcdefg")
}
