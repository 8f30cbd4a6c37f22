"""The arena: its families, rows that can go on, and the rules of its verdict."""

import json
import math
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

import benchmarks.arena.toy_text
from benchmarks.arena import crafter_arms, horizon, predictions, runs
from benchmarks.arena.families import FAMILIES
from benchmarks.arena.lead import PROPERTIES, lead_cells, property_cells, ratios
from benchmarks.arena.verdict import judge, pooled_cells, verdicts
from benchmarks.prediction.play import RESULTS, read_rows
from benchmarks.prediction.rows import Runs
from hierroom.lab.advise.measures import Known
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text

INSTALLED = [name for name, family in FAMILIES.items() if family.is_installed]


@pytest.mark.parametrize("name", INSTALLED)
def test_family_has_eight_tasks_that_differ_in_their_limits(name):
    tasks = FAMILIES[name].tasks()
    module = __import__(f"benchmarks.arena.{name}", fromlist=["TASKS"])
    limits = {one["max_steps"] if isinstance(one, dict) else one.max_steps for one in module.TASKS.values()}
    assert len(tasks) >= 8
    assert len(limits) >= 3


def test_own_worlds_are_in_no_committed_table():
    tables = [*RESULTS.glob("*/sweep.csv"), RESULTS / "prediction" / "new.csv"]
    used = {row.get("graph") or row["task"] for path in tables for row in read_rows(path)}
    assert used
    assert not used & {*FAMILIES["escape_room"].tasks(), *FAMILIES["workshop"].tasks()}


@pytest.mark.parametrize(
    ("name", "actions", "achieved"),
    [
        ("lake_small", [1, 2, 1, 1, 2, 2], ["cell 1", "cell 2"]),  # down, right, to the key, round the hole, to the end
        ("cliff_2", [0, *[1] * 7, 0, 0, *[3] * 8, 2], None),  # the second one, which does not count yet, then the first
    ],
)
def test_cells_count_in_order_only(name, actions, achieved):
    task = benchmarks.arena.toy_text.TASKS[name]
    env = task.make()
    env.reset(seed=0)
    for n, action in enumerate(actions):
        observation, reward, terminated, _, info = env.step(action)
        assert terminated == (achieved is not None and n == len(actions) - 1)
    assert reward == float(achieved is not None)
    assert [goal for goal, is_achieved in task.goals.items() if is_achieved(env, info)] == (achieved or ["cell 1"])
    assert observation["done"] == len(achieved or [1])


def test_a_taxi_brings_the_next_passenger_home():
    task = benchmarks.arena.toy_text.TASKS["taxi_2"]
    env = task.make()
    env.reset(seed=0)
    taxi, terminated, n_actions = env.unwrapped, False, 0
    while not terminated:
        mask = taxi.action_mask(taxi.s)
        row, col, passenger, home = taxi.decode(taxi.s)
        if (row, col) == taxi.locs[home if passenger == 4 else passenger]:
            action = 5 if passenger == 4 else 4
        else:
            action = int(env.np_random.choice(np.flatnonzero(mask[:4])))
        _, reward, terminated, _, _ = env.step(action)
        n_actions += 1
        assert n_actions < 10_000 or pytest.fail("no way home")
    assert (env.homes, reward) == (2, 1.0)


def test_predictions_go_on_row_by_row_and_a_failure_is_a_row(tmp_path, monkeypatch):
    family, seen = FAMILIES["workshop"], []
    known = dict.fromkeys(Known.__annotations__, 10)

    def played(_, task):
        seen.append(task)
        if len(seen) == 2:
            raise RuntimeError("broken")
        return known | {"expected_steps": 4000.0, "limit": 400, "random_success": 0.1}

    monkeypatch.setattr(predictions, "played", played)
    for _ in range(2):  # the second time nothing is lacking
        predictions.predict_rows([family], tmp_path)
    rows = read_rows(tmp_path / "predictions.csv")
    assert seen == [row["task"] for row in rows] == [*family.tasks()]
    assert [row["outside"] for row in rows][:3] == ["", "RuntimeError: broken", ""]
    assert [bool(row["hippo steps_to_50"]) for row in rows][:3] == [True, False, True]


def test_no_run_without_a_prediction(tmp_path):
    with pytest.raises(InputError, match="commit it before"):
        runs.run_rows(runs.plan("workshop", [*FAMILIES["workshop"].tasks()]), tmp_path)


@pytest.mark.parametrize(
    ("code", "error"), [("exit('no display')", "RuntimeError: no display"), ("import os; os.kill(os.getpid(), 9)", "")]
)
def test_a_run_that_fails_is_a_row_and_one_that_was_cut_off_is_none(code, error, tmp_path, monkeypatch):
    program = tmp_path / "python"
    program.write_text(f"#!{sys.executable}\n{code}\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setattr(runs.sys, "executable", str(program))
    task = next(iter(FAMILIES["workshop"].tasks()))
    write_atomically(tmp_path / "predictions.csv", csv_text([{"family": "workshop", "task": task}]))
    some = [runs.Run("workshop", task, "ppo", 0)]
    if error:
        runs.run_rows(some, tmp_path)
    else:
        with pytest.raises(KeyboardInterrupt):
            runs.run_rows(some, tmp_path)
    assert [row["error"] for row in read_rows(tmp_path / "runs.csv")] == [error] * bool(error)


def test_two_runs_at_a_time_write_all_rows(tmp_path, monkeypatch):
    both = threading.Barrier(2)
    monkeypatch.setattr(runs, "in_process", lambda *_, **identity: {"waited": both.wait()})
    some = runs.plan("workshop", [*FAMILIES["workshop"].tasks()])[:6]
    predicted = [{"family": "workshop", "task": task} for task in FAMILIES["workshop"].tasks()]
    write_atomically(tmp_path / "predictions.csv", csv_text(predicted))
    runs.run_rows(some, tmp_path, processes=2)
    rows = read_rows(tmp_path / "runs.csv")
    assert sorted(row["waited"] for row in rows) == ["0"] * 3 + ["1"] * 3
    assert {(row["task"], row["method"]) for row in rows} == {(one.task, one.method) for one in some}


def test_a_run_stops_after_three_good_evaluations_in_a_row():
    stops = runs.learned()
    trainer = SimpleNamespace(evaluation=None)
    assert not stops(trainer)
    for success, expected in [(1, False), (0.9, False), (0.95, False), (1, False), (0.96, True)]:
        trainer.evaluation = SimpleNamespace(success_rate=success)
        assert [stops(trainer) for _ in range(5)] == [expected] * 5  # updates without an evaluation change nothing


def test_plan_has_a_third_seed_of_a_quarter_of_the_tasks():
    every = runs.plan("toy_text", [*FAMILIES["toy_text"].tasks()])
    assert len(every) == 3 * (2 * 10 + 3)
    assert len({one.task for one in every if one.seed == 2}) == 3


def test_a_family_is_whole_when_each_planned_run_has_a_row(tmp_path):
    tasks = ["x", "y"]
    predicted = [{"family": family, "task": task} for family in ("workshop", "toy_text") for task in tasks]
    done = [vars(one) for one in (*runs.plan("toy_text", tasks), *runs.plan("workshop", tasks)[:-1])]
    write_atomically(tmp_path / "predictions.csv", csv_text(predicted))
    write_atomically(tmp_path / "runs.csv", csv_text(done))
    assert runs.whole_families(tmp_path) == ["toy_text"]


def test_runs_are_inside_outside_or_undecided():
    steps = np.log([100.0, 100.0, 100.0, 100.0, 100.0, 10.0, 10.0])
    low, high = steps.copy(), steps.copy()
    high[2:5] = np.inf  # never, in 100 steps
    low[5:] = -np.inf  # before the first evaluation, at step 10
    found = Runs(np.array([*"abcdefg"]), np.array(["x"] * 7), low, high)
    ends = np.log([50.0, 120.0, 10.0, 10.0, 10.0, 5.0, 20.0]), np.log([200.0, 200.0, 90.0, 110.0, math.inf, 9.0, 30.0])
    kinds = [verdicts(found.where(np.arange(7) == n), ends[0][[n]], ends[1][[n]]) for n in range(7)]
    inside, outside, undecided = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    assert kinds == [inside, outside, outside, undecided, inside, inside, outside]


def test_judge_says_something_of_two_rows(tmp_path):
    task = {"family": "toy_text", "task": "taxi_1"}
    play = task | dict.fromkeys((*Known.__annotations__, "hitting_time"), "10") | {"error": ""}
    first = task | {"outside": "", "hippo steps_to_50": "1000", "hippo steps_to_50_low": "500"}
    first |= {"hippo steps_to_50_high": "inf"}
    second = {**first, "task": "taxi_2", "outside": "too long", "hippo steps_to_50": ""}
    run = task | {"method": "hippo", "seed": "0", "steps": "5000", "first": "50"}
    run |= {"steps_to_50": "1900", "steps_to_95": "", "error": ""}
    tables = {"play": [play], "predictions": [first, second], "runs": [run, run | {"seed": "1", "error": "no display"}]}
    for name, rows in tables.items():
        write_atomically(tmp_path / f"{name}.csv", csv_text(rows))
    text = judge(tmp_path, ["toy_text"])
    assert "| toy_text | hippo | steps_to_50 | 1 | 1 | 1 | - | - | 1.90 | 1.00 | 1 | 0 | 0 | 1.00 |" in text
    assert "| toy_text | 2 | 1 | 1 x too long |" in text
    assert "failed: toy_text/taxi_1 hippo 1: no display" in text


def test_families_are_pooled_as_draws():
    def cells(family, factor, coverage):
        return [family, "hippo", "steps_to_50", "8", "20", "19", "-", "0.50", factor, "0.40", "9", "1", "0", coverage]

    verdict = [cells("one", "1.00", "1.00"), cells("two", "2.00", "0.80"), cells("three", "4.00", "0.60")]
    (pooled,) = pooled_cells(verdict)
    # Student's t with two degrees of freedom is 2.92 at 95%: 0.8 +- 2.92 * 0.2 / sqrt(3), and log 2 * 2.92 / sqrt(3).
    assert pooled[:5] == ["hippo", "steps_to_50", "3", "-", "0.50 [0.50, 0.50]"]
    assert pooled[5] == f"2.00 [{2 / 2 ** (2.92 / 3**0.5):.2f}, {2 * 2 ** (2.92 / 3**0.5):.2f}]"
    assert pooled[7] == f"0.80 [{0.8 - 0.2 * 2.92 / 3**0.5:.2f}, {0.8 + 0.2 * 2.92 / 3**0.5:.2f}]"
    assert [*pooled_cells(verdict[:2])] == []
    assert next(pooled_cells([cells("four", "inf", "0.60"), *verdict]))[5] == "inf"


def test_authors_logs_become_rows_of_their_first_million_steps(tmp_path):
    log = {"method": "human", "seed": "3", "xs": [600_000, 900_000, 1_100_000], "reward": [1.0, 2.0, 9.0]}
    log |= {"achievement_collect_wood": [5, 1, 1], "achievement_eat_plant": [0, 3, 1]}
    path = tmp_path / "scores.json"
    path.write_text(json.dumps([log]), encoding="utf-8")
    (row,) = crafter_arms.logged_rows(path)
    assert row == {
        **{"arm": "human (authors' log)", "seed": "3", "steps": "900000", "episodes": "2", "return": "1.5"},
        **{"score": f"{(math.sqrt(101 * 51) - 1) / 100:.6g}", "collect_wood": "1", "eat_plant": "0.5"},
    }


def test_ratio_to_hippo_of_each_task_and_what_goes_with_it():
    def run(task, method, steps):
        row = {"family": "f", "task": task, "method": method, "seed": "0", "steps": "5000", "first": "50"}
        return row | {"steps_to_50": steps, "steps_to_95": "", "error": ""}

    hippo = {"a": "100", "b": "100", "c": "100", "d": "", "e": ""}
    flat = {"a": "200", "b": "400", "c": "", "d": "300", "e": ""}
    rows = [run(task, name, of[task]) for name, of in (("hippo", hippo), ("ppo-bonus", flat)) for task in hippo]
    found = ratios(rows, "ppo-bonus")
    assert found == pytest.approx({"f/a": 2, "f/b": 4, "f/c": math.inf, "f/d": 0, "f/e": math.nan}, nan_ok=True)
    assert [*lead_cells(rows, ["f"])] == [["f", "ppo-bonus", "steps_to_50", "4", "1", "3", "2.00", "4.00", "4.00"]]
    goals = {"f/a": 2, "f/b": 3, "f/c": 9, "f/d": 1, "f/e": 0}
    play = {task: dict.fromkeys(PROPERTIES, "1") | {"goals": str(n)} for task, n in goals.items()}
    play["f/a"]["random_success"] = ""
    ((family, tasks, *cells),) = property_cells(rows, play, ["f"])
    assert (family, tasks) == ("f", "4")
    assert dict(zip(PROPERTIES, cells, strict=True)) == dict.fromkeys(PROPERTIES, "-") | {"goals": "1.00"}


def test_states_of_a_lake_are_its_cells_before_and_after_the_key():
    row = horizon.measured("toy_text", "lake_small")
    assert (row["states"], row["shortest"]) == (13 + 13 + 1, 6)  # 16 cells without two holes and a goal; the end
    assert row["log_samples"] == pytest.approx(math.log(200**2 * 4 ** row["horizon"]))
