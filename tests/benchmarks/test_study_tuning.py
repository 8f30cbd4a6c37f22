"""The study's settings with the largest area under the learning curve, on tables with known answers."""

import sys

import pytest

from benchmarks.study import tuning
from hierroom.support.errors import InputError


def run_of(method, graph, area, seed=100, **settings):
    of = {name: str(value) for name, value in settings.items()}
    return {"method": method, "graph": graph, "seed": str(seed), "area_under_curve": str(area), **of}


ROWS = [
    run_of("hippo", "one", 0.5, learning_rate=0.001, gamma=0.95, novelty_bonus=0.03),
    run_of("hippo", "two", 0.7, learning_rate=0.001, gamma=0.95, novelty_bonus=0.03),
    run_of("hippo", "one", 0.9, learning_rate=0.001, gamma=0.98, novelty_bonus=0.03),
    run_of("hippo", "two", 0.2, learning_rate=0.001, gamma=0.98, novelty_bonus=0.03),
    run_of("ppo-novelty", "one", 0.0, learning_rate=0.001, gamma=0.98, novelty_bonus=0.03),
    run_of("ppo-novelty", "one", 0.0004, learning_rate=0.001, gamma=0.98, novelty_bonus=0.1),
    run_of("ppo", "one", 0, gamma=0.95),  # of a table without the other columns
    run_of("ppo", "one", 0, gamma=0.98),
]


def test_best_setting_has_the_largest_mean_area():
    hippo, novelty, ppo = tuning.tuned(ROWS)
    assert hippo.best == (("gamma", 0.95),)
    assert hippo.area(hippo.best) == pytest.approx(0.6)
    assert novelty.best == (("novelty_bonus", 0.1),)
    assert ppo.best is None
    (tied,) = tuning.tuned([run_of("ppo", "one", 0.5, gamma=0.98), run_of("ppo", "one", 0.5, gamma="9.5e-1")])
    assert tied.best == (("gamma", 0.98),)  # the first of those that are alike


def test_tuning_command_prints_the_table(monkeypatch, capsys, tmp_path):
    path = tmp_path / "runs.csv"
    columns = list(ROWS[0])
    lines = [",".join(row.get(name, "") for name in columns) for row in ROWS[:6]]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    others = tmp_path / "others.csv"
    columns = list(ROWS[-1])
    others.write_text("\n".join([",".join(columns), *(",".join(row.values()) for row in ROWS[6:])]) + "\n")
    monkeypatch.setattr(sys, "argv", ["tuning", str(path), str(others)])
    assert tuning.main() == 0
    assert capsys.readouterr().out.splitlines() == [
        "| method | settings | largest area with | area | of each run | area of the other settings |",
        "|---|---:|---|---:|---:|---:|",
        "| hippo | 2 | gamma 0.95 | 0.60 | 0.50 to 0.70 | 0.55 to 0.55 |",
        "| ppo-novelty | 2 | novelty_bonus 0.1 | 0.0004 | 0.0004 to 0.0004 | 0 to 0 |",
        "| ppo | 2 | - | 0 | 0 | 0 |",
    ]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([], "there are no training runs to compare; give a table of them"),
        (ROWS + ROWS[:1], "hippo was trained twice on one with seed 100 and the same settings"),
        ([*ROWS, run_of("ppo", "one", 0.5)], "the runs of ppo do not all have the same columns of learning_rate, .*"),
        ([run_of("ppo", "one", "much", gamma=0.98)], "a run of ppo on one needs a number: .*'much'"),
        (ROWS[:3], "the settings of hippo were not all trained on the same graphs with the same seeds"),
    ],
)
def test_incomparable_runs_raise_input_error(rows, words):
    with pytest.raises(InputError, match=words):
        tuning.tuned(rows)
