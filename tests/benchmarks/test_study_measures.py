"""The table of measures of the study's goal graphs."""

import csv
import math
from dataclasses import asdict

import pytest

from benchmarks.measures.mdp import graph_mdp
from benchmarks.measures.summary import measure_mdp, measure_walk
from benchmarks.study import measures_table as table
from benchmarks.study.tables import MEASURES_PATH, measures_for, read_measures
from hierroom.complexity import analyze
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError


def test_measures_table_keeps_existing_rows(tmp_path, monkeypatch):
    settings = table.Settings(horizon=8, size=11, episodes=8, max_steps=40, chain_episodes=8, chain_steps=300)
    fork = GoalGraph((0, 0), 2)
    graphs = {"a": (GoalGraph((0,), 1), ""), "b": (fork, ""), "b-twin": (GoalGraph((0, 0), 1, label="b-twin"), "b")}
    path = tmp_path / "new" / "measures.csv"
    first = table.make_table({"a": graphs["a"]}, settings, path)
    measured = []
    monkeypatch.setattr(
        table, "measured_row", lambda *given, make=table.measured_row: measured.append(given[0].name) or make(*given)
    )
    rows = table.make_table(graphs, settings, path)
    assert measured == ["b", "b-twin"]
    assert rows[0] == first[0]
    assert list(csv.DictReader(path.open())) == rows
    for row, graph in zip(rows, "abb", strict=True):
        report = analyze(graph)
        assert float(row["expected_steps"]) == pytest.approx(report.expected_steps, rel=1e-12)
        assert float(row["hitting_time"]) == pytest.approx(report.hitting_time, rel=1e-9)
        assert (int(row["nodes"]), int(row["goals"])) == (report.nodes, report.graph.n_goals)
        assert 0 <= float(row["play_success"]) <= 1
        assert not math.isnan(float(row["play_expected_steps"]))
    assert [row["twin_of"] for row in rows] == ["", "", "b"]
    table.make_table({"a": graphs["a"]}, table.Settings(horizon=9, size=11, episodes=4, chain_episodes=4), path)
    assert measured[2:] == ["a"]  # other settings


@pytest.mark.parametrize("name", ["c", "keys-0-1-1-2-4-exit-1", "keys-3-0-0-exit-3"])
def test_measures_equal_the_committed_table(name):
    """A small graph, one whose cover time is sampled, and one with other numbers of rooms."""
    (row,) = (row for row in read_measures(MEASURES_PATH) if row["graph"] == name)
    report = analyze(GoalGraph(tuple(map(int, row["key_rooms"].split("-"))), int(row["exit_room"])))
    found = asdict(measure_mdp(graph_mdp(report.augmented), 20)) | asdict(measure_walk(report.chain))
    assert {one: float(row[one]) for one in found} == pytest.approx(found, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("graph,twin_of,goals,settings\na,,3,x\n", "no table of measures: it has no column rooms"),
        ("graph,settings\na\n", "line 2 has not as many entries as the line that names them"),
        ('"graph\n', "cannot read the table"),
    ],
)
def test_invalid_measures_table_raises_input_error(tmp_path, text, message):
    path = tmp_path / "measures.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_measures(path)
    assert "\n" not in str(caught.value)


def test_empty_measures_table_raises_input_error(tmp_path):
    (tmp_path / "measures.csv").write_text("graph,twin_of,rooms,goals,settings\n")
    with pytest.raises(InputError, match=r"measures\.csv holds no measures; make it: python -m"):
        measures_for(tmp_path / "sweep.csv")
