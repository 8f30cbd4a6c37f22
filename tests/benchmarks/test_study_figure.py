"""The study's figure: every goal graph has a mark where its numbers say."""

import sys

import numpy as np
import pytest
from study_tables import write_tables

from benchmarks.study import figure
from hierroom.support.errors import InputError

STEPS = {"a": [100, 300, 200], "b": [400, 500, 900], "own": [800, None, None], "c": [600, 700, None]}


@pytest.fixture
def tables(tmp_path):
    runs = [
        {"graph": graph, "method": "hippo", "seed": seed, "steps_to_95": n or ""}
        for graph, several in STEPS.items()
        for seed, n in enumerate(several)
    ]
    measures = [
        {"graph": graph, "twin_of": "", "rooms": 3, "goals": 5, "settings": "", "width": i, "play_success": i}
        for i, graph in enumerate(STEPS)
    ]
    write_tables(tmp_path, runs=runs, measures=measures)
    return tmp_path


def words(tables, *others):
    return ["figure", f"{tables}/runs.csv", "--measures", f"{tables}/measures.csv", *others]


def test_marks_stand_at_the_medians_and_above_all_where_half_never_got_there(tables):
    options = figure.Options(tables / "runs.csv", tables / "f.png", ("width", "play_success"))
    measured = figure.known_measures(tables / "measures.csv")
    trained = figure.read_trained(figure.read_rows(options.table), measured, "steps_to_95")
    for axes in figure.draw(trained, measured, options).axes:
        reached, never = (np.asarray(marks.get_offsets()).tolist() for marks in axes.collections[1:])
        assert reached == [[0, 200], [1, 500], [3, 700]]
        assert never == [[2, 1.5 * 900]]
        low_to_high = [segment[:, 1].tolist() for segment in axes.collections[0].get_segments()]
        assert low_to_high == [[100, 300], [400, 900], [600, 1.5 * 900]]
        assert {text.get_text() for text in axes.texts} == {"a", "b", "c"}


def test_graphs_that_share_a_count_stand_side_by_side():
    counts = np.array([2.0, 4, 2, 2, 8, 2, 4, 4, 2, 4, 8, 8])
    spread = figure._spread(counts)
    assert len(np.unique(spread)) == len(counts)
    assert np.abs(spread - counts).max() < 1, "half of the way to the next"
    for count in (2, 4, 8):
        assert spread[counts == count].mean() == pytest.approx(count)
    measured = np.arange(12.0)
    assert figure._spread(measured) is measured


def test_a_measure_with_a_wide_range_has_a_logarithmic_axis(tables, monkeypatch):
    options = figure.Options(tables / "runs.csv", tables / "f.png", ("narrow", "wide", "width"))
    measured = [
        {**row, "narrow": str(1 + i), "wide": str(1 + 10 * i)}
        for i, row in enumerate(figure.known_measures(tables / "measures.csv"))
    ]
    for name in ("narrow", "wide"):
        monkeypatch.setitem(figure.MEASURES, name, 1)
    trained = figure.read_trained(figure.read_rows(options.table), measured, "steps_to_95")
    scales = [axes.get_xscale() for axes in figure.draw(trained, measured, options).axes]
    assert scales == ["linear", "log", "linear"]  # width begins with 0


def test_a_path_without_an_ending_is_that_of_a_png(tables, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", words(tables, "--shown", "width", "--out", f"{tables}/new/f"))
    assert figure.main() == 0
    assert capsys.readouterr().out == f"drawn: {tables}/new/f.png\n"
    assert (tables / "new" / "f.png").read_bytes().startswith(b"\x89PNG")
    assert not (tables / "new" / "f").exists()


@pytest.mark.parametrize(
    ("others", "message"),
    [
        (["--shown", "luck", "--out", "f.png"], "cannot show luck; known of all graphs, .*, are width, play_success"),
        (["--shown", "--out", "f.png"], "show at least one measure"),
        (["--shown", "width", "--out", "f.xyz"], "cannot draw to f.xyz"),
    ],
)
def test_the_command_refuses_in_one_line(tables, monkeypatch, others, message):
    monkeypatch.chdir(tables)
    monkeypatch.setattr(sys, "argv", words(tables, *others))
    with pytest.raises(InputError, match=message):
        figure.main()
