"""Fits to runs that are made up, and predictions that are judged by such."""

import csv
import math

import numpy as np
import pytest

from benchmarks.prediction import rows
from benchmarks.prediction.fit import factors, fit_worlds
from benchmarks.prediction.judge import Options, judged, one_seed_factor
from benchmarks.prediction.rows import Runs
from hierroom.lab.advise.measures import Known
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text


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


def worlds_made_up(n_worlds, spread, between, random):
    """Return runs of tasks with three seeds, eight tasks a world but eighty in the first, and their log measures."""
    sizes = [80, *[8] * (n_worlds - 1)]
    worlds = np.repeat([f"world {n}" for n in range(n_worlds)], [3 * size for size in sizes])
    tasks = np.array([f"task {n // 3}" for n in range(len(worlds))])
    x = np.repeat(random.uniform(5, 10, sum(sizes)), 3)
    effects = np.repeat([3 * between, *random.normal(0, between, n_worlds - 1)], [3 * size for size in sizes])
    times = 2 + 0.8 * x + effects + np.repeat(random.normal(0, spread, sum(sizes)), 3)
    return Runs(tasks, worlds, times, times.copy()), x, effects


def test_a_new_world_is_predicted_by_all_worlds_alike():
    """The world with the most tasks lies three deviations off, and would carry a pooled line with it."""
    random = np.random.default_rng(0)
    runs, x, effects = worlds_made_up(30, spread=0.3, between=0.5, random=random)
    line = fit_worlds(runs, x)
    of_worlds = [effects[runs.worlds == world][0] for world in np.unique(runs.worlds)]
    assert line.slope == pytest.approx(0.8, abs=0.05)
    assert line.of(np.array([7.5]))[0] == pytest.approx(8 + np.mean(of_worlds), abs=0.1)
    assert line.sigma == pytest.approx(np.hypot(0.3, np.std(of_worlds, ddof=1) * np.sqrt(1 + 1 / 30)), rel=0.1)


def test_a_world_without_any_success_has_a_finite_intercept():
    runs, x, _ = worlds_made_up(5, spread=0.3, between=0.1, random=np.random.default_rng(1))
    never = runs.worlds == "world 4"
    late = Runs(runs.tasks, runs.worlds, np.where(never, 9.0, runs.low), np.where(never, np.inf, runs.high))
    line, known = fit_worlds(late, x), fit_worlds(runs.where(~never), x[~never])
    assert np.isfinite(line).all()
    assert line.of(np.array([7.5]))[0] > known.of(np.array([7.5]))[0] + 0.1


def test_left_out_worlds_count_alike_in_the_interval():
    """A hundred tasks of one world are right; two of the ten of another are three times too late."""
    errors = np.log([1.0] * 100 + [1.0] * 8 + [3.0] * 2)
    worlds = np.array(["large"] * 100 + ["small"] * 10)
    runs = Runs(np.arange(110).astype(str), worlds, errors, errors)
    assert factors(runs, np.zeros(110))[1] == pytest.approx(1)
    assert factors(runs, np.zeros(110), worlds)[1] == pytest.approx(3)


def test_runs_of_the_arena_are_fitted_too(tmp_path, monkeypatch):
    known = dict.fromkeys(Known.__annotations__, "10") | {"family": "toy_text", "task": "taxi_1", "error": ""}
    run = {"family": "toy_text", "task": "taxi_1", "method": "hippo", "steps": "5000", "first": "50", "error": ""}
    runs = [run | {"steps_to_50": steps} for steps in ("1900", "0", "")] + [run | {"error": "no display"}]
    for name, table in {"play": [known], "runs": runs}.items():
        write_atomically(tmp_path / f"{name}.csv", csv_text(table))
    monkeypatch.setattr(rows, "ARENA", tmp_path)
    found = rows.read_runs("hippo", "steps_to_50", *rows.known_tasks())
    arena = found.where(found.worlds == "toy_text")
    assert len(found) > 1000
    assert arena.tasks.tolist() == ["toy_text/taxi_1"] * 3
    assert np.exp(arena.low) == pytest.approx([1900, 0, 5000])
    assert np.exp(arena.high) == pytest.approx([1900, 50, np.inf])
