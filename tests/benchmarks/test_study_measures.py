"""The table of measures of the study's goal graphs."""

from dataclasses import asdict

import pytest

from benchmarks.measures.mdp import graph_mdp
from benchmarks.measures.summary import measure_mdp, measure_walk
from benchmarks.study.tables import MEASURES_PATH, read_measures
from hierroom.complexity import analyze
from hierroom.goals import GoalGraph


@pytest.mark.parametrize("name", ["c", "keys-0-1-1-2-4-exit-1", "keys-3-0-0-exit-3"])
def test_measures_equal_the_committed_table(name):
    """A small graph, one whose cover time is sampled, and one with other numbers of rooms."""
    (row,) = (row for row in read_measures(MEASURES_PATH) if row["graph"] == name)
    report = analyze(GoalGraph(tuple(map(int, row["key_rooms"].split("-"))), int(row["exit_room"])))
    found = asdict(measure_mdp(graph_mdp(report.augmented), 20)) | asdict(measure_walk(report.chain))
    assert {one: float(row[one]) for one in found} == pytest.approx(found, rel=1e-9)
