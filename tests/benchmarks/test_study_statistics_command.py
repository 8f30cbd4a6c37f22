"""The command that correlates measures with training results: its output, its file and its errors."""

import csv
import sys

import numpy as np
import pytest
from study_tables import measured_rows, run_rows, write_tables

from benchmarks.study import statistics
from benchmarks.study.result import markdown, results_of
from benchmarks.study.tables import read_rows
from hierroom.support.errors import InputError
from hierroom.support.tables import csv_text


@pytest.fixture
def tables(tmp_path):
    graphs = [f"g{i}" for i in range(10)]
    rng = np.random.default_rng(5)
    steps = {graph: (1000 * i + 1000 + rng.integers(0, 900, 3)).tolist() for i, graph in enumerate(graphs)}
    steps["g9"] = [None, None, 20_000]
    steps |= {f"g{i}-twin": steps[f"g{i}"] for i in range(5)}
    known = {
        "settings": ["x"] * 10,
        "rooms": [3] * 5 + [4] * 5,
        "goals": [5] * 5 + [7] * 5,
        "expected_steps": range(10),
    }
    measures = measured_rows(graphs, graphs[:5], **known, width=rng.permutation(10))
    few = run_rows({graph: steps[graph] for graph in graphs[:3]})
    write_tables(tmp_path, runs=run_rows(steps), few=few, measures=measures)
    return tmp_path


def test_the_command_prints_a_table_and_writes_every_number(tables, monkeypatch, capsys):
    out = tables / "out.csv"
    words = f"{tables}/runs.csv --measures {tables}/measures.csv --resamples 50 --out {out}".split()
    monkeypatch.setattr(sys, "argv", ["statistics", *words])
    assert statistics.main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert (
        lines[0] == "**hippo**, steps to 95%, 10 goal graphs, 3 seeds; on 1 half of the seeds or more never get there:"
    )
    assert lines[4].startswith("| expected_steps | 1.00 [")
    assert lines[-1].startswith("5 twins: 1.00")  # halves of three seeds are unequal
    assert lines[-1].endswith("differ by a factor of 1.00")
    rows = {(row["measure"], row["statistic"]): row for row in csv.DictReader(out.open())}
    assert float(rows["expected_steps", "at 5 goals"]["value"]) == pytest.approx(1)
    assert rows["goals", "given goals"]["value"] == ""
    assert (rows["twins", "spearman"]["graphs"], rows["width", "kendall"]["graphs"]) == ("5", "10")
    read = results_of([*rows.values()])
    assert [markdown(one).splitlines() for one in read] == [lines]
    monkeypatch.setattr(sys, "argv", ["statistics", *words, "--rooms", "4"])
    assert statistics.main() == 0
    assert "5 goal graphs, 3 seeds" in capsys.readouterr().out
    assert {(row["seeds_min"], row["seeds_max"]) for row in rows.values()} == {("3", "3")}
    monkeypatch.setattr(sys, "argv", ["statistics", *words, "--seeds", "1"])
    assert statistics.main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert (
        lines[0] == "**hippo**, steps to 95%, 10 goal graphs, 1 seed; on 1 half of the seeds or more never get there:"
    )
    assert lines[-1].startswith("5 twins: 1.00")
    assert {(row["seeds_min"], row["seeds_max"]) for row in csv.DictReader(out.open())} == {("1", "1")}
    assert "minus hitting time" not in {statistic for _, statistic in rows if rows[_, statistic]["value"]}


def test_milestone_is_chosen_over_all_rooms(tables, monkeypatch, capsys):
    """Of four rooms hippo never gets to 95% on two graphs of five; of all it does on eight of ten."""
    steps = {f"g{i}": [None if i > 7 else 100 + i] for i in range(10)}
    known = {"settings": ["x"] * 10, "rooms": [3] * 5 + [4] * 5, "goals": [5] * 10, "width": range(10)}
    rows = [{**row, "steps_to_50": "50"} for row in run_rows(steps)]
    write_tables(tables, runs=rows, measures=measured_rows([*steps], **known))
    words = f"{tables}/runs.csv --measures {tables}/measures.csv --resamples 10 --rooms 4".split()
    monkeypatch.setattr(sys, "argv", ["statistics", *words])
    assert statistics.main() == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first == "**hippo**, steps to 95%, 5 goal graphs, 1 seed; on 2 half of the seeds or more never get there:"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.csv", "--measures", "measures.csv"], "cannot read the table"),
        (["few.csv", "--measures", "measures.csv"], "needs 4 goal graphs or more; hippo has 3"),
        (["runs.csv", "--measures", "measures.csv", "--rooms", "9"], "needs 4 goal graphs or more; hippo has 0"),
        (["runs.csv", "--measures", "measures.csv", "--seeds", "0"], "the table has no row of a seed below 0"),
    ],
)
def test_invalid_statistics_options_raise_input_error(tables, monkeypatch, words, message):
    monkeypatch.chdir(tables)
    monkeypatch.setattr(sys, "argv", ["statistics", *words])
    with pytest.raises(InputError, match=message):
        statistics.main()


def test_incomplete_correlations_raise_input_error_with_command():
    row = {"method": "hippo", "outcome": "steps_to_95", "measure": "seeds", "statistic": "halves"}
    row |= {"value": "1", "low": "", "high": "", "graphs": "9", "seeds_min": "2", "seeds_max": "2"}
    with pytest.raises(InputError, match=r"hippo lack seeds never, twins spearman, twins factor; python -m benchmarks"):
        results_of([row])


def test_formula_like_names_are_read_unchanged(tmp_path):
    rows = [{"variant": name, "seed": "0"} for name in ("#1", "-goal", "'tis")]
    (tmp_path / "runs.csv").write_text(csv_text(rows))
    assert read_rows(tmp_path / "runs.csv") == rows
