"""Predictions of new tasks, judged by runs that are made up."""

import csv
import math

import numpy as np
import pytest

from benchmarks.prediction.judge import Options, judged, one_seed_factor
from benchmarks.prediction.rows import Runs


def test_predictions_are_judged_by_hand(tmp_path):
    runs = [  # HiPPO is predicted 17,050 [7,907, 53,640] and 38,580 [17,770, beyond], PPO+Bonus 31,000 [9,380, beyond]
        {"method": "hippo", "steps_to_50": "34100", "steps_to_95": ""},
        {"method": "ppo-bonus", "steps_to_50": "9000", "steps_to_95": ""},
    ]
    trees = tmp_path / "trees.csv"
    with trees.open("w", newline="") as file:
        writer = csv.DictWriter(file, ["graph", "steps", *runs[0]])
        writer.writeheader()
        writer.writerows({"graph": "workshop:4:4493:mixed", "steps": "1000448", **run} for run in runs)
    rows = {(row["method"], row["milestone"]): row for row in judged(Options(trees, tmp_path / "rooms.csv"))}
    assert {key: (row["factor"], row["coverage"], row["never"], row["never_found"]) for key, row in rows.items()} == {
        ("hippo", "steps_to_50"): ("2", "1", 0, 0),
        ("hippo", "steps_to_95"): ("nan", "1", 1, 0),
        ("ppo-bonus", "steps_to_50"): ("3.44", "0", 0, 0),
    }


@pytest.mark.parametrize(
    ("steps", "factor"), [([100, 200, 400], math.sqrt(8)), ([100, 200, 400, math.inf], 2), ([100], math.nan)]
)
def test_one_seed_is_compared_with_the_median_of_the_others(steps, factor):
    """Of 100, 200 and 400: 100 to the others' geometric mean of 283, 200 to 200, 400 to 141."""
    logs, names = np.log(steps), np.array(["x"] * len(steps))
    assert one_seed_factor(Runs(names, names, logs, logs)) == pytest.approx(factor, nan_ok=True)
