"""Draw the pictures of README and docs that show trained agents, from the rows in `benchmarks/results/`.

    python -m benchmarks.figures            # draw what is not as its rows are
    python -m benchmarks.figures --check    # exit code 1 where one differs

A picture is drawn as the command before it on its page says. It holds the digest of the points in it, so that it is
drawn again when these change, and not when a library draws them otherwise.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shlex
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import matplotlib
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator
from numpy.typing import ArrayLike
from PIL import Image

from benchmarks.committed import ROOT
from benchmarks.study import figure as scatter
from benchmarks.study import forest
from benchmarks.tables import PAGES
from hierroom.cli import run
from hierroom.compare.style import STYLE
from hierroom.errors import InputError
from hierroom.files import write_atomically
from hierroom.paper.figures import Figure3, Figure4, Figure5

PLACE = re.compile(
    r"`python -m (benchmarks\.study\.(?:figure|forest)|hierroom\.paper figure\d) ([^`]+)`[^`]*?!\[[^]]*\]\((\S+)\)"
)
PAPER = {"figure3": Figure3, "figure4": Figure4, "figure5": Figure5}


@dataclass(frozen=True)
class Options:
    """Draw the pictures, or check them.

    Args:
        check: draw nothing, and say which pictures differ.
    """

    check: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


@dataclass(frozen=True)
class Picture:
    """A picture on a page.

    Args:
        path: of the file.
        program: what draws it, such as `hierroom.paper figure3`.
        arguments: of the program.
    """

    path: Path
    program: str
    arguments: tuple[str, ...]

    def draw(self) -> Figure:
        """The figure, from the committed rows.

        Raises:
            InputError: if a run that it needs is not done, or the command has several sizes.
        """
        with chdir(ROOT), matplotlib.rc_context(STYLE):
            if self.program == "benchmarks.study.figure":
                return scatter.figure_of(tyro.cli(scatter.Options, args=self.arguments))
            if self.program == "benchmarks.study.forest":
                return forest.figure_of(tyro.cli(forest.Options, args=self.arguments))
            figure = tyro.cli(PAPER[self.program.split()[1]], args=self.arguments)
            if len(figure.runs.sizes) > 1:
                raise InputError(f"{self.path.name} is one picture; the command on its page has several sizes")
            sweep = figure.runs.sweep(figure.graphs, figure.methods)
            done, planned = len(sweep.rows()), len(sweep.plan.runs())
            if done < planned:
                raise InputError(f"{done} of {planned} runs of {self.path.name} are done; it is drawn when all are")
            return figure.draw(sweep, figure.runs.sizes[0])


def pictures() -> list[Picture]:
    """Those of all pages."""
    return [
        Picture(Path(os.path.normpath(page.parent / link)), program, tuple(shlex.split(arguments)))
        for page in PAGES
        for program, arguments, link in PLACE.findall(page.read_text())
    ]


def digest(figure: Figure) -> str:
    """Of its texts and colours, and of its points to four digits."""
    told = hashlib.sha256()
    for legend in figure.legends:
        told.update(repr([text.get_text() for text in legend.get_texts()]).encode())
    for axes in figure.axes:
        told.update(repr([axes.get_xlabel(), axes.get_ylabel(), axes.get_title()]).encode())
        told.update(repr([text.get_text() for text in axes.texts]).encode())
        if isinstance(axes.yaxis.get_major_locator(), FixedLocator):  # names, not numbers that matplotlib chose
            told.update(repr([label.get_text() for label in axes.get_yticklabels()]).encode())
        for colour, points in _marks(axes):
            told.update(colour.encode())
            told.update(" ".join(f"{number:.4g}" for number in np.asarray(points, dtype=float).ravel()).encode())
    return told.hexdigest()


def _marks(axes: Axes) -> Iterator[tuple[str, ArrayLike]]:
    """Its lines, marks and bands, the colour and the points of each."""
    for line in axes.lines:
        yield to_hex(line.get_color()), line.get_xydata()
    for collection in axes.collections:
        colour = " ".join(map(to_hex, np.concatenate([collection.get_facecolor(), collection.get_edgecolor()])))
        if isinstance(collection, LineCollection):
            points = collection.get_segments()
        elif isinstance(collection, PolyCollection):
            points = [path.vertices for path in collection.get_paths()]
        else:
            points = [np.ma.getdata(collection.get_offsets())]
        yield from ((colour, one) for one in points)


def main() -> int:
    """The command."""
    options, n_other = tyro.cli(Options, description=__doc__), 0
    for picture in pictures():
        figure = picture.draw()
        now = digest(figure)
        if picture.path.exists() and Image.open(picture.path).info.get("Points") == now:
            continue
        n_other += 1
        print(f"{'differs' if options.check else 'drawn'}: {picture.path.relative_to(ROOT)}")
        if not options.check:
            data = io.BytesIO()
            with matplotlib.rc_context(STYLE):
                figure.savefig(data, format="png", dpi=150, metadata={"Points": now})
            write_atomically(picture.path, data.getvalue())
    return 1 if options.check and n_other else 0


if __name__ == "__main__":
    run(main)
