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
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.study import figure as study
from benchmarks.tables import PAGES, ROOT, done_rows
from hierroom.cli import run
from hierroom.compare.style import STYLE
from hierroom.files import write_atomically
from hierroom.paper.figures import Figure3, Figure4, Figure5
from hierroom.paper.published import METHODS

PLACE = re.compile(r"`python -m (benchmarks\.study\.figure|hierroom\.paper figure\d) ([^`]+)`[^`]*?!\[[^]]*\]\((\S+)\)")
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
            InputError: if a run that it needs is not done.
        """
        with chdir(ROOT), matplotlib.rc_context(STYLE):
            if self.program == "benchmarks.study.figure":
                return study.figure_of(tyro.cli(study.Options, args=self.arguments))
            figure = tyro.cli(PAPER[self.program.split()[1]], args=self.arguments)
            (size,) = figure.runs.sizes
            sweep = figure.runs.sweep(figure.runs.graphs, METHODS)
            done_rows("paper", sweep.plan.runs())
            return figure.draw(sweep, size)


def pictures() -> list[Picture]:
    """Those of all pages."""
    return [
        Picture(Path(os.path.normpath(page.parent / link)), program, tuple(shlex.split(arguments)))
        for page in PAGES
        for program, arguments, link in PLACE.findall(page.read_text())
    ]


def digest(figure: Figure) -> str:
    """Of its labels and of its points, to four digits."""
    told = hashlib.sha256()
    for axes in figure.axes:
        told.update(repr([axes.get_xlabel(), axes.get_ylabel(), axes.get_title()]).encode())
        told.update(repr([text.get_text() for text in axes.texts]).encode())
        for points in _points(axes):
            told.update(" ".join(f"{number:.4g}" for number in np.asarray(points, dtype=float).ravel()).encode())
    return told.hexdigest()


def _points(axes: Axes) -> Iterator[np.ndarray]:
    """Of its lines, marks and bands."""
    for line in axes.lines:
        yield line.get_xydata()
    for collection in axes.collections:
        if isinstance(collection, LineCollection):
            yield from collection.get_segments()
        else:
            yield np.ma.getdata(collection.get_offsets())
            yield from (path.vertices for path in collection.get_paths())


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
