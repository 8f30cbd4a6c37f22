"""What benchmarks/prediction.py says of a table of training runs."""

import importlib
from pathlib import Path

import pytest
from pictures import has_colour, pixels
from scipy import ndimage

from hierroom.complexity import analyze
from hierroom.errors import InputError

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


@pytest.fixture
def prediction(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("prediction")


def rows(method, steps):
    settings = {"preset": "default", "meta": "none", "size": "19", "drop_key": "False", "steps": "10"}
    return [{"method": method, "graph": graph, "steps_to_95": text, **settings} for graph, text in steps]


def test_medians_by_hand(prediction):
    table = rows("hippo", [("a", "1"), ("a", "9"), ("a", "2"), ("b", "4"), ("c", ""), ("d", "5"), ("d", "")])
    assert prediction.training_steps(table) == {"hippo": {"a": 2, "b": 4, "c": float("inf"), "d": float("inf")}}


def test_too_few_graphs_are_left_out(prediction):
    assert prediction.training_steps(rows("ppo", [("a", "1"), ("b", "2"), ("c", "3")])) == {}


@pytest.mark.parametrize("table", [[], [{"graph": "a", "steps_to_95": "1"}]])
def test_another_table_is_refused(prediction, table):
    with pytest.raises(InputError, match=r"no rows with .*method"):
        prediction.training_steps(table)


def test_rows_of_one_method_in_different_settings_are_refused(prediction):
    table = [*rows("hippo", [("a", "1")]), *rows("ppo", [("a", "1")])]
    table[1]["meta"] = "random"  # another method may have another meta-controller
    prediction.training_steps(table)
    table += [{**table[0], "steps": "20"}]
    with pytest.raises(InputError, match="rows of one method differ in steps: 10, 20"):
        prediction.training_steps(table)


@pytest.mark.parametrize(("steps", "expected"), [(("1", "2", "3", ""), "1.00"), (("4", "3", "2", "1"), "-1.00")])
def test_correlation_by_hand(prediction, capsys, steps, expected):
    """On a, c, f, g all the paper's hitting times and the expected steps rise; what was never solved ranks last."""
    prediction.print_correlations(prediction.training_steps(rows("hippo", zip("acfg", steps, strict=True))))
    cells = capsys.readouterr().out.splitlines()[-1].strip("| ").split(" | ")
    assert cells[:2] == ["hippo", "4"]
    assert cells[-2:] == [expected, expected]


def test_the_readme_has_what_the_committed_rows_say(prediction, capsys):
    table = importlib.import_module("run_table").read(ROOT / "benchmarks" / "results" / "hippo.csv")
    prediction.print_correlations(prediction.training_steps(table))
    assert capsys.readouterr().out in README


def test_a_picture_is_drawn(prediction, tmp_path):
    prediction.draw({"hippo": {"a": 1e5, "b": 2e5, "c": float("inf"), "d": 3e5}}, tmp_path / "prediction.png")
    colours = pixels(tmp_path / "prediction.png")
    assert colours.shape == (540, 750, 3)
    labels, n = ndimage.label(has_colour(colours, "tab:blue"))
    marks = sorted(ndimage.center_of_mass(labels > 0, labels, range(1, n + 1)))
    assert len(marks) == 4  # one in the legend above, one for each graph that was solved
    (_, d), (_, b), (_, a) = marks[1:]
    heights = [-height for height, _ in marks[:0:-1]]
    assert heights[2] - heights[1] == pytest.approx(heights[1] - heights[0], abs=1.5)  # 1, 2 and 3 times 1e5 steps
    expected = {letter: analyze(letter).expected_steps for letter in "abd"}
    scale = (d - a) / (expected["d"] - expected["a"])
    assert scale > 0
    assert b - a == pytest.approx(scale * (expected["b"] - expected["a"]), abs=1.5)
