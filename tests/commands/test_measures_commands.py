"""The output of ``python -m hierroom complexity --measures``."""

import csv
import io
import json

import pytest

from hierroom.commands.complexity import ComplexityArguments, show
from hierroom.complexity import Walk, analyze
from hierroom.support.errors import InputError


@pytest.fixture
def printed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")

    def show_and_read(**options):
        show(ComplexityArguments(measures=True, **options))
        return capsys.readouterr().out

    return show_and_read


def test_measures_are_printed_in_80_columns(printed):
    lines = printed(graph=("a", "c"), horizon=10).splitlines()
    assert max(map(len, lines)) <= 80
    rows = [line.split() for line in lines if line.startswith((" a ", " c "))]
    assert [row[0] for row in rows] == ["a", "c", "a", "c"]
    assert rows[1][1:3] == ["9", "5"]  # states, steps
    assert rows[3][6] == "173.8"  # commute time: the mean of 73.8 steps to the exit, and 100 back
    assert not any("…" in line for line in lines)


def test_json_and_csv_have_the_same_values(printed):
    (graph,) = json.loads(printed(graph="c", json=True))
    (row,) = csv.DictReader(io.StringIO(printed(graph="c", csv=True)))
    assert list(graph) == list(row)
    assert graph["horizon"] == 20
    assert float(row["effective_horizon"]) == graph["effective_horizon"]
    assert float(row["covering_high"]) == graph["covering_high"]


def test_latex_and_markdown_equal_the_printed_table(printed):
    shown = [line.split() for line in printed(graph="c").splitlines() if line.startswith(" c ")]
    latex = printed(graph="c", latex=True).splitlines()
    assert latex[4].removesuffix(r" \\").split(" & ") == [*shown[0], *shown[1][1:]]
    assert latex[2].count("&") == latex[4].count("&")
    assert r"H\_1" in latex[2]
    head, _, row = printed(graph="c", markdown=True).splitlines()
    assert row.strip("| ").split(" | ") == [*shown[0], *shown[1][1:]]
    assert head.count("|") == row.count("|")


def test_room_numbers_do_not_change_measures(printed):
    one, other = (json.loads(printed(graph=name, json=True))[0] for name in ("keys-0-0-1-exit-3", "keys-3-0-0-exit-1"))
    assert one | {"graph": ""} == other | {"graph": ""}


def test_walk_and_reading_options_change_measures(printed):
    walk, reading = (0.5, 0.4, 0.1), ("own room", "accessible", "accessible")
    (graph,) = json.loads(printed(graph="c", walk=walk, json=True))
    report = analyze("c", walk=Walk(*walk))
    assert graph["commute"] == pytest.approx(report.expected_steps + 1 / 0.1), "from the exit it only starts again"
    (usual,) = json.loads(printed(graph="c", json=True))
    assert graph["pic"] == usual["pic"]
    (other,) = json.loads(printed(graph="c", reading=reading, json=True))
    assert other["pic"] != usual["pic"]


def test_levels_option_prints_no_walk_measures(printed):
    text = printed(graph="a", levels=2, horizon=40, seed=1)
    assert [line.split()[:2] for line in text.splitlines() if line.startswith(" a ")] == [["a", "1"], ["a", "2"]]
    assert "mixing" not in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"measures": True, "graph": "g", "horizon": 5}, "at least 7 steps, but the horizon is 5"),
        ({"graph": "g", "horizon": 5}, "go with --measures"),
        ({"measures": True, "graph": "g", "levels": 1, "walk": (0.5, 0.4, 0.1)}, "which no --walk and no --reading"),
        ({"measures": True, "graph": "g", "sort": "std"}, "neither --draw nor --sort"),
        ({"measures": True, "graph": "g", "horizon": 0}, "horizon"),
        ({"measures": True, "from_play": "random"}, "--from-play"),
        ({"seed": 3}, "or --seed with --levels"),
    ],
)
def test_contradicting_options_raise_input_error(options, words):
    with pytest.raises(InputError, match=words):
        show(ComplexityArguments(**options))
