"""The study's table of other levels, where each kind of levels has its own reference."""

import sys
from pathlib import Path

import pytest
from study_tables import measured_rows, run_rows, write_tables

from benchmarks.study import levels
from hierroom.support.errors import InputError

GRAPHS = ("one", "two", "three")
MEASURES = measured_rows(GRAPHS, rooms=(2, 3, 4), goals=(2, 4, 6), settings=(0, 0, 0))
STEPS = {
    ("larger grid, with", "hippo"): {"one": [100, 100], "two": [200, 200], "three": [300, 300]},
    ("larger grid, without", "ppo-bonus"): {"one": [300, 300], "two": [600, 600], "three": [900, 900]},
    ("shorter limit, with", "hippo"): {"one": [400, 400], "two": [800, 800], "three": [1200, 1200]},
    ("shorter limit, without", "ppo-bonus"): {"one": [200, 200], "two": [400, 400], "three": [None, None]},
}


def rows():
    return [
        {**row, "variant": variant, "method": method, "steps_to_50": row["steps_to_95"] or "900", "success_rate": "1"}
        for (variant, method), steps in STEPS.items()
        for row in run_rows(steps)
    ]


def test_methods_are_compared_on_the_same_levels(monkeypatch, capsys, tmp_path):
    write_tables(tmp_path, runs=rows(), measures=MEASURES)
    monkeypatch.setattr(sys, "argv", ["levels", f"{tmp_path}/runs.csv", "--measures", f"{tmp_path}/measures.csv"])
    assert levels.main() == 0
    assert capsys.readouterr().out.splitlines() == [
        "| levels | method | compared by | steps / reference's | verdict | slower on | success | above 50% on |",
        "|---|---|---|---:|---|---:|---:|---:|",
        "| larger grid | hippo | - | - | - | - | 100.0% | 3 of 3 |",
        "| larger grid | ppo-bonus | steps to 95% | 3.00 [3.00, 3.00] | slower | 3 of 3 | 100.0% | 3 of 3 |",
        "| shorter limit | hippo | - | - | - | - | 100.0% | 3 of 3 |",
        "| shorter limit | ppo-bonus | steps to 95% | 0.50 [0.50, ∞] | no significant difference | 1 of 3 "
        "| 100.0% | 3 of 3 |",
    ]


def test_variant_without_levels_raises_input_error():
    with pytest.raises(InputError, match="called as its levels, a comma and its method, not 'larger grid'"):
        levels.levels([{**row, "variant": "larger grid"} for row in rows()], MEASURES, levels.Options(Path("runs.csv")))
