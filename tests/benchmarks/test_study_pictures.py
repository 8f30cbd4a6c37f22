"""Pictures of the study show the committed rows."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from benchmarks import figures
from benchmarks.study.picture import digest
from hierroom.support.errors import InputError

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("picture", figures.pictures(), ids=lambda picture: picture.path.name)
def test_each_picture_shows_its_committed_rows(picture):
    assert picture.is_current(), "python -m benchmarks.figures draws it"


def test_figures_list_every_picture_of_training_results():
    paper = {f"paper-figure{number}.png" for number in (3, 4, 5)}
    assert {picture.path.name for picture in figures.pictures()} == paper | {
        *("prediction.png", "study.png", "study-paper-features.png", "factors.png", "factors-paper-features.png"),
        "conjecture.png",
    }


def test_digest_changes_with_points_colours_and_names():
    def drawn(height=1.0, colour="red", name="one", has_band=False, lines=()):
        figure = Figure()
        axes = figure.subplots()
        axes.plot([0, 1], [0, height], color=colour, label=name)
        axes.scatter([0], [1.0])
        if has_band:
            axes.fill_between([0, 1], [0, 0], [1, 1])
        if lines:
            axes.set_yticks([0, 1], lines)
        figure.legend()
        return digest(figure)

    assert drawn() == drawn(1.00001)
    others = drawn(1.001), drawn(colour="blue"), drawn(name="two"), drawn(has_band=True), drawn(lines=("a", "b"))
    assert len({drawn(), *others, drawn(lines=("b", "a"))}) == 7


def test_picture_of_unfinished_runs_raises_input_error():
    def picture(*arguments):
        return figures.Picture(ROOT / "x.png", "benchmarks.paper figure4", arguments)

    with pytest.raises(InputError, match=r"0 of 8 runs of x\.png are done"):
        picture("--seeds", "2", "--out", "nowhere").draw()
    with pytest.raises(InputError, match=r"x\.png is one picture; the command on its page has several sizes"):
        picture("--sizes", "19", "31").draw()
