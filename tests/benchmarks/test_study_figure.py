"""The study's figure: every goal graph has a mark where its numbers say."""

import sys

import numpy as np
import pytest
from study_tables import write_tables

from benchmarks.study import figure
from benchmarks.study.tables import read_measures
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


def test_marks_are_at_medians_or_above_all(tables):
    options = figure.Options(tables / "runs.csv", tables / "f.png", ("width", "play_success"))
    measured = read_measures(tables / "measures.csv")
    trained = figure.read_trained(figure.read_rows(options.table), measured, "steps_to_95")
    for axes in figure.draw(trained, measured, options).axes:
        reached, never = (np.asarray(marks.get_offsets()).tolist() for marks in axes.collections[1:])
        assert reached == [[0, 200], [1, 500], [3, 700]]
        assert never == [[2, 1.5 * 900]]
        low_to_high = [segment[:, 1].tolist() for segment in axes.collections[0].get_segments()]
        assert low_to_high == [[100, 300], [400, 900], [600, 1.5 * 900]]
        assert {text.get_text() for text in axes.texts} == {"a", "b", "c"}


def test_path_without_suffix_is_a_png(tables, monkeypatch, capsys):
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
def test_invalid_figure_options_raise_input_error(tables, monkeypatch, others, message):
    monkeypatch.chdir(tables)
    monkeypatch.setattr(sys, "argv", words(tables, *others))
    with pytest.raises(InputError, match=message):
        figure.main()
