"""The table of a sweep: rows that are added, found again and replaced, and their medians."""

from contextlib import suppress
from dataclasses import replace

import pandas as pd
import pytest
from tiny_sweep import plan

from hierroom.lab.sweep.plan import Plan
from hierroom.lab.sweep.summary import summarise
from hierroom.lab.sweep.sweep import Sweep
from hierroom.lab.sweep.table import SweepTable
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically


def test_row_of_another_config_is_replaced_alone(tmp_path):
    table = SweepTable(tmp_path)
    (old,), (new,) = plan("gamma=0.9", "seed=0").runs(), plan("gamma=0.8", "seed=0").runs()
    (other,) = plan("gamma=0.9", "seed=1").runs()
    for run in (old, other):
        table.add(run, {"success_rate": 0.123456789, "length": 40.0, "steps_to_95": float("inf")})
    assert [*table.of((old, other))["success_rate"]] == ["0.123457"] * 2
    assert len(table.of((new,))) == 0
    table.add(new, {"success_rate": 1.0, "length": 1.0, "more": 'it, "quoted"'})
    assert [*table.read()["digest"]] == [other.digest, new.digest]
    assert [*table.read()["more"]] == ["", 'it, "quoted"']
    assert table.read()["steps_to_95"][0] == ""


NUMBERS = {"success_rate": 0.5, "length": 40.0, "length_over_shortest": 2.0, "greedy_success_rate": 0.5}


@pytest.mark.parametrize("entry", ["gamma=0.9{}0.99", "steps=300{}400"])
def test_adding_values_keeps_existing_rows(tmp_path, entry):
    table, points = SweepTable(tmp_path), [{"steps": "100", "graph": "c", "success_rate": "0.5"}]
    first, rest = (plan(*entry.format(between).split()[:1], "seed=0").runs() for between in (" ", ","))
    table.add(first[0], NUMBERS, points)
    assert len(table.of(rest)) == 1
    for run in rest[1:]:
        table.add(run, NUMBERS, points)
    rows = table.of(rest)
    assert [*rows["digest"]] == [run.digest for run in rest]
    assert table.curves().keys() == {run.digest for run in rest}
    column = {"gamma": "gamma", "steps": "planned_steps"}[entry.partition("=")[0]]
    assert [line[0] for line in summarise(rest, rows).lines] == entry.partition("=")[2].split("{}")
    assert [*rows[column]] == entry.partition("=")[2].split("{}")


def test_row_without_exclusions_stays_next_to_excluding_row(tmp_path):
    table = SweepTable(tmp_path)
    of_several = plan("graph=rooms:3", "method=ppo", 'exclude=[[], ["b"]]', "seed=0").runs()
    for run in of_several:
        table.add(run, {"steps": 1})
    (other,) = plan("graph=rooms:3", "method=ppo", 'exclude=[["b"]]', "gamma=0.5", "seed=0").runs()
    table.add(other, {"steps": 1})
    assert {*table.read()["digest"]} == {of_several[0].digest, other.digest}


def test_complete_fills_only_empty_cells(tmp_path):
    table = SweepTable(tmp_path)
    (run,), grown = plan("gamma=0.9", "seed=0").runs(), plan("gamma=0.9,0.99", "seed=0").runs()
    table.add(replace(run, identity={**run.identity, "variant": "mine"}), NUMBERS)
    table.complete(grown)
    (row,) = table.read().to_dict("records")
    assert (row["variant"], row["gamma"], row["digest"]) == ("mine", "0.9", run.digest)
    before = table.path.stat().st_mtime_ns
    table.complete(grown)
    assert table.path.stat().st_mtime_ns == before


@pytest.mark.parametrize("n_written", [0, 1, 2])
@pytest.mark.parametrize("replaces", [False, True])
def test_a_row_is_never_without_its_learning_curve(tmp_path, monkeypatch, n_written, replaces):
    """A crash between the tables leaves a run without a row, which is done again, and each row with its curve."""
    table, points = SweepTable(tmp_path), [{"steps": "100", "graph": "c", "success_rate": "0.5"}]
    (old,), (new,) = plan("gamma=0.9", "seed=0").runs(), plan("gamma=0.8", f"seed={0 if replaces else 1}").runs()
    (other,) = plan("gamma=0.9", "seed=2").runs()
    table.add(old, {"success_rate": 0.5}, points)
    left = iter(range(n_written))

    def write_then_crash(path, content):
        if next(left, None) is None:
            raise KeyboardInterrupt
        write_atomically(path, content)

    with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr("hierroom.lab.sweep.table.write_atomically", write_then_crash)
        table.add(new, {"success_rate": 0.5}, points)
    for run in (other, new):
        assert {*table.read()["digest"]} <= table.curves().keys()
        table.add(run, {"success_rate": 0.5}, points)
    assert {*table.read()["digest"]} == table.curves().keys()
    assert table.curves().keys() == {run.digest for run in (other, new, *([] if replaces else [old]))}
    assert {len(curve) for curve in table.curves().values()} == {1}


def test_foreign_csv_raises_input_error(tmp_path):
    path = tmp_path / "sweep.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="is no table of a sweep"):
        SweepTable(tmp_path).read()
    path.write_text("")
    assert SweepTable(tmp_path).read().empty


@pytest.mark.parametrize("name", ["sweep.csv", "curves.csv"])
@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("abc", "line 2: success_rate is a number from 0 to 1, not 'abc'"),
        ("7", "line 2: success_rate is a number from 0 to 1, not '7'"),
        ("0.25,1", "line 2 has not as many entries as the line that names them"),
    ],
)
def test_broken_cell_raises_input_error_before_training(name, cell, said, tmp_path):
    sweep = Sweep(plan("seed=0,1"), tmp_path)
    points = [{"steps": "100", "graph": "c", "success_rate": "0.25"}]
    sweep.table.add(sweep.plan.runs()[0], {**NUMBERS, "success_rate": 0.25}, points)
    text = (tmp_path / name).read_text()
    assert text.count(",0.25") == 1
    (tmp_path / name).write_text(text.replace(",0.25", f",{cell}"))
    with pytest.raises(InputError, match=rf"{name} is broken: {said}"):
        sweep.fill()
    assert not (tmp_path / "runs").exists()


def test_table_saved_by_a_spreadsheet_takes_new_rows(tmp_path):
    table, (first, second) = SweepTable(tmp_path), plan("seed=0,1").runs()
    points = [{"steps": "100", "graph": "c", "success_rate": "0.25"}]
    table.add(first, NUMBERS, points)
    for path in tmp_path.glob("*.csv"):
        path.write_text(path.read_text(), encoding="utf-8-sig", newline="\r\n")
    table.complete((first, second))
    table.add(second, NUMBERS, points)
    assert [*table.read()] == [*first.identity, *NUMBERS, "digest"]
    assert [*table.read()["digest"]] == [*table.curves()] == [first.digest, second.digest]
    _, *rows = table.path.read_text().splitlines(keepends=True)
    for left in (rows, rows[:1]):
        table.path.write_text("".join(left))
        with pytest.raises(InputError, match=r"(has no column digest|line 1 names a column twice)"):
            table.add(second, NUMBERS)
        assert table.path.read_text() == "".join(left)


@pytest.mark.parametrize("name", ["sweep.csv", "curves.csv", ".sweep.csv.lock"])
def test_symlinked_table_raises_input_error_before_training(name, tmp_path):
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match=rf"cannot write .*{name}: it is a link"):
        Sweep(plan("seed=0"), tmp_path / "out").fill()
    assert [path.name for path in (tmp_path / "out").iterdir()] == [name]
    assert (tmp_path / "mine").read_text() == "precious"


def test_a_summary_has_medians_and_their_spread():
    runs = plan("method=hippo,ppo", "gamma=0.9", seeds=3).runs()
    numbers = {"steps_to_50": "", "length": "40", "length_over_shortest": "1.5", "greedy_success_rate": "0.5"}
    found = {"hippo": ("0.5", "1200000"), "ppo": ("0.25", "")}
    rows = []
    for run in runs:
        success, to_95 = found[run.config.agents.method]
        steps = "900000" if run.config.seed == 1 and to_95 else to_95
        rows.append({**run.identity, **numbers, "success_rate": success, "steps_to_95": steps, "digest": run.digest})
    summary = summarise(runs, pd.DataFrame(rows[:-1]))
    assert "single" not in summary.caption
    assert summary.markdown().splitlines() == [
        "| method | runs | steps to 50% | steps to 95% | success | length | / shortest | greedy |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
        "| hippo | 3 | - | 1.20M (900k to 1.20M) | 50.0% | 40 | 1.50 | 50.0% |",
        "| ppo | 2 | - | - | 25.0% | 40 | 1.50 | 50.0% |",
    ]
    assert summary.table().row_count == 2


def test_task_summary_leaves_out_unknown_columns():
    runs = Plan({"task": ["tests.chest_task:chest", "chest_task:free"]}).runs()
    numbers = {"success_rate": "0.5", "length": "40", "length_over_shortest": ""}
    summary = summarise(runs, pd.DataFrame([{**run.identity, **numbers, "digest": run.digest} for run in runs]))
    assert summary.headings == ("task", "runs", "steps to 50%", "steps to 95%", "success", "length", "greedy")
    assert [line[0] for line in summary.lines] == ["chest_task:chest", "chest_task:free"]


def test_a_single_run_has_the_interval_of_its_evaluations():
    (run,) = plan("seed=0").runs()
    numbers = {"steps_to_50": "10000", "steps_to_50_low": "9000", "steps_to_50_high": "12000", "success_rate": "0.6"}
    numbers |= {"steps_to_95": "200000", "steps_to_95_low": "190000", "steps_to_95_high": "", "success_low": "0.5"}
    numbers |= {"success_high": "0.7", "length": "40", "length_over_shortest": "", "greedy_success_rate": "0.2"}
    row = {**run.identity, **numbers, "digest": run.digest}
    summary = summarise([run], pd.DataFrame([row]))
    assert summary.caption.endswith("; of a single run, in square brackets the 95% interval that its evaluations leave")
    line = summary.lines[0]
    assert line[-6:] == ("10k [9,000, 12k]", "200k [190k, -]", "60.0% [50.0%, 70.0%]", "40", "-", "20.0%")
