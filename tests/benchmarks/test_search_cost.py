"""The controller of benchmarks/searching.py: it escapes, and costs what the results page says."""

from pathlib import Path

import pytest

from benchmarks.informed import Informed
from benchmarks.result_table import ResultTable
from benchmarks.search_cost import HEADINGS, row_of
from benchmarks.searching import Searching
from hierroom.agents.evaluation import evaluate
from hierroom.meta import make_meta
from hierroom.runs.config.presets import find_preset
from hierroom.runs.environments import make_turns

ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"

CHAIN = str(BENCHMARKS / "graphs" / "chain.toml")


def config_of(graph, **changes):
    preset = find_preset("default")
    return preset.changed(graph=graph, **changes, threads=1)


def turns_in(graph, n, **changes):
    return make_turns(config_of(graph, **changes), n, 0, levels="evaluation")


@pytest.mark.parametrize(("graph", "size"), [("a", 19), ("f", 19), ("g", 11), ("d", 31), (CHAIN, 19)])
def test_searching_escapes_no_faster_than_informed(graph, size):
    n = 25
    turns = turns_in(graph, n, size=size)
    searching = evaluate(Searching(make_meta("fixed-dfs"), turns), turns, 2 * n)
    informed = evaluate(Informed(make_meta("fixed-dfs"), n), turns_in(graph, n, size=size), 2 * n)
    assert searching.success_rate == 1.0
    assert informed.length <= searching.length < 1.5 * informed.length


def test_search_cost_row_equals_the_committed_table():
    table = ResultTable.read(BENCHMARKS / "results" / "search_cost.csv")
    assert table.headings == HEADINGS
    row = row_of(config_of("a"), 1000)
    assert row == table.rows[0]
    shortest, informed, searched, ratio = map(float, row[1:5])
    assert shortest <= informed <= searched
    assert ratio == pytest.approx(searched / informed, abs=0.02)
