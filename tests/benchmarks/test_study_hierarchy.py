"""The study's comparison of a method with a hierarchy and one without, on tables with known answers."""

import csv
import sys

import numpy as np
import pytest
from study_tables import write_tables

from benchmarks.study import hierarchy
from hierroom.support.errors import InputError

STEPS = {
    "easy": {"hippo": [100_000, 110_000, 120_000], "ppo-bonus": [100_000, 115_000, 125_000]},
    "middle": {"hippo": [200_000, 210_000, 220_000], "ppo-bonus": [400_000, 420_000, 900_000]},
    "hard": {"hippo": [300_000, 300_000, None], "ppo-bonus": [None, None, 800_000]},
    "hopeless": {"hippo": [None, None, None], "ppo-bonus": [None, None, None]},
}


@pytest.fixture
def tables(tmp_path):
    runs = [
        {
            "graph": graph,
            "method": method,
            "seed": seed,
            "steps_to_95": n or "",
            "steps_to_50": 50_000,
            "success_rate": 0.1 if n is None else 1,
        }
        for graph, methods in STEPS.items()
        for method, several in methods.items()
        for seed, n in enumerate(several)
    ]
    measures = [
        {"graph": graph, "twin_of": "", "rooms": 9, "goals": 3, "settings": "", "play_expected_steps": 10 * i}
        | {"exit_depth": 2 + i // 2, "width": 1 + i % 2, "expected_steps": 1}
        for i, graph in enumerate(STEPS)
    ]
    write_tables(tmp_path, runs=runs, measures=measures)
    return tmp_path


def printed(tables, monkeypatch, capsys, *words):
    paths = [f"{tables}/runs.csv", "--measures", f"{tables}/measures.csv"]
    outcome = [] if "--outcome" in words else ["--outcome", "steps_to_95"]
    monkeypatch.setattr(sys, "argv", ["hierarchy", *paths, *outcome, *words])
    assert hierarchy.main() == 0
    return capsys.readouterr().out.splitlines()


def test_each_graph_has_a_ratio_with_interval(tables, monkeypatch, capsys):
    printed(tables, monkeypatch, capsys, "--out", f"{tables}/out.csv")
    rows = {row["graph"]: row for row in csv.DictReader((tables / "out.csv").open())}
    easy, middle, hard, hopeless = (
        {name: float(rows[graph][name]) for name in ("ratio", "low", "high")} for graph in STEPS
    )
    assert easy["ratio"] == pytest.approx(115 / 110)
    assert easy["low"] < 1 < easy["high"]
    assert middle["ratio"] == 2
    assert middle["low"] == pytest.approx(400 / 220)  # 7 of 27 draws have the lowest median, for both 7%
    assert middle["high"] == pytest.approx(900 / 200)
    assert hard["ratio"] == np.inf
    assert hopeless == {"ratio": 1, "low": 1, "high": 1}
    assert [float(rows[graph]["flat_success"]) for graph in STEPS] == pytest.approx([1, 1, 0.1, 0.1])


def test_the_table_counts_graphs_by_exit_depth(tables, monkeypatch, capsys):
    lines = printed(tables, monkeypatch, capsys)
    assert lines[0].startswith(
        "| exit depth | graphs | hippo: steps_to_95 | ppo-bonus: steps_to_95 | ratio | pays on | costs on |"
    )
    assert (
        lines[2] == "| 2 | 2 | 210k (110k to 210k) | 420k (115k to 420k) | 1.4 (1.0 to 2.0) | 1 | 0 | 2 | 2 | 2 | 2 |"
    )
    assert lines[3] == "| 3 | 2 | - (300k to -) | - | ∞ (1.0 to ∞) | 0 | 0 | 1 | 0 | 1 | 0 |"
    assert lines[5] == (
        "Fewer median steps to 95%, of 4 goal graphs: ppo-bonus on 0, hippo on 3. "
        "Every seed is before every seed of the other method: ppo-bonus on 0, hippo on 1. "
        "Every seed gets to 95%: ppo-bonus on 2 (7 of 12 runs), hippo on 2 (8 of 12 runs)."
    )
    assert lines[7] == (
        "Hardest tenth by play_expected_steps, with ties 1 of 4 goal graphs: "
        "hippo ends above 50% success on 0, ppo-bonus on 0."
    )


def test_by_option_counts_graphs_by_width(tables, monkeypatch, capsys):
    lines = printed(tables, monkeypatch, capsys, "--by", "width")
    assert lines[0].startswith("| width | graphs |")
    assert [line.split(" | ")[:2] for line in lines[2:4]] == [["| 1", "2"], ["| 2", "2"]]
    assert lines[2].split(" | ")[5:7] == ["0", "0"]  # easy and hard
    assert lines[3].split(" | ")[5:7] == ["1", "0"]  # middle and hopeless


def test_hierarchy_falls_back_to_the_lower_milestone(tables):
    rows, measured = (hierarchy.read_rows(tables / f"{name}.csv") for name in ("runs", "measures"))
    options = hierarchy.Options(tables)

    def compared(rows):
        return hierarchy.compare(hierarchy.both_methods(rows, measured, options), measured, options)

    outcomes = {one.outcome for one in compared(rows)}
    assert outcomes == {"steps_to_50"}, "ppo-bonus never got to 95% on two of four graphs"
    easier = [row for row in rows if row["graph"] in ("easy", "middle")]
    assert {one.outcome for one in compared(easier)} == {"steps_to_95"}


def test_single_seed_gives_no_counts_or_intervals(tables, monkeypatch, capsys):
    every = [*csv.DictReader((tables / "runs.csv").open())]
    lines = printed(tables, monkeypatch, capsys, "--seeds", "1", "--out", f"{tables}/out.csv")
    assert (
        lines[2] == "| 2 | 2 | 200k (100k to 200k) | 400k (100k to 400k) | 1.4 (1.0 to 2.0) | - | - | 2 | 2 | 2 | 2 |"
    )
    assert {(row["low"], row["high"]) for row in csv.DictReader((tables / "out.csv").open())} == {("", "")}
    begun = [row for row in every if (row["graph"], row["seed"]) < ("middle", "1")]
    write_tables(tables, runs=begun)  # a second seed that is on its way
    assert printed(tables, monkeypatch, capsys)[2].split(" | ")[5] == "-"
    write_tables(tables, runs=every)
    lines = printed(tables, monkeypatch, capsys, "--seeds", "2")
    assert (
        lines[2] == "| 2 | 2 | 205k (105k to 205k) | 410k (108k to 410k) | 1.4 (1.0 to 2.0) | 1 | 0 | 2 | 2 | 2 | 2 |"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--flat", "ppo"], "the table's methods are hippo, ppo-bonus; there is no 'ppo'"),
        (["--hardest-by", "luck"], "the measure of the hardest must be one of .*expected_steps, not 'luck'"),
        (["--measures", "none.csv"], "there is no table of measures none.csv; run this"),
        (["--resamples", "1"], "resamples must be at least 2"),
        (["--level", "95"], "between 0 and 1, not 95"),
    ],
)
def test_invalid_hierarchy_options_raise_input_error(tables, monkeypatch, capsys, words, message):
    with pytest.raises(InputError, match=message):
        printed(tables, monkeypatch, capsys, *words)
