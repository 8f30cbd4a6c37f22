"""Draw the pictures of README and docs that show trained agents, from the rows in `benchmarks/results/`.

    python -m benchmarks.figures            # draw the pictures whose rows have changed
    python -m benchmarks.figures --check    # exit code 1 where one differs

A picture is drawn as the command before it on its page says; of those that `benchmarks.paper` draws, this command
alone writes the digest of the points. So a picture is drawn again if its points change, but not if a new version of a
library draws them differently.
"""

from __future__ import annotations

import os
import re
import shlex
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import matplotlib
import tyro
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.committed import ROOT
from benchmarks.paper.figures import Figure3, Figure4, Figure5
from benchmarks.study import figure as scatter
from benchmarks.study import forest
from benchmarks.study.picture import ENTRY, digest, write
from benchmarks.tables import PAGES
from hierroom.lab.compare.style import STYLE
from hierroom.support.cli import run
from hierroom.support.errors import InputError

PLACE = re.compile(
    r"`python -m (benchmarks\.study\.(?:figure|forest)|benchmarks\.paper figure\d) ([^`]+)`[^`]*?!\[[^]]*\]\((\S+)\)"
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
        program: what draws it, such as `benchmarks.paper figure3`.
        arguments: of the program.
    """

    path: Path
    program: str
    arguments: tuple[str, ...]

    def draw(self) -> Figure:
        """Return the figure, from the committed rows.

        Raises:
            InputError: if a run that it needs is not done, or the command has several sizes.
        """
        with chdir(ROOT), matplotlib.rc_context(STYLE):
            if self.program == "benchmarks.study.figure":
                return scatter.figure_of(tyro.cli(scatter.Options, args=self.arguments))
            if self.program == "benchmarks.study.forest":
                return forest.figure_of(tyro.cli(forest.Options, args=self.arguments))
            figure = tyro.cli(PAPER[self.program.split()[-1]], args=self.arguments)
            if len(figure.runs.sizes) > 1:
                raise InputError(f"{self.path.name} is one picture; the command on its page has several sizes")
            sweep = figure.runs.sweep(figure.graphs, figure.methods)
            done, planned = len(sweep.rows()), len(sweep.plan.runs())
            if done < planned:
                raise InputError(f"{done} of {planned} runs of {self.path.name} are done; it is drawn when all are")
            return figure.draw(sweep, figure.runs.sizes[0])

    def is_current(self) -> bool:
        """Return whether the file shows what would be drawn now."""
        if not self.path.exists():
            return False
        with Image.open(self.path) as image:
            return image.info.get(ENTRY) == digest(self.draw())


def pictures() -> list[Picture]:
    """Those of all pages."""
    return [
        Picture(Path(os.path.normpath(page.parent / link)), program, tuple(shlex.split(arguments)))
        for page in PAGES
        for program, arguments, link in PLACE.findall(page.read_text(encoding="utf-8"))
    ]


def main() -> int:
    """Run the command."""
    options, n_other = tyro.cli(Options, description=__doc__), 0
    for picture in pictures():
        if picture.is_current():
            continue
        n_other += 1
        if options.check:
            print(f"differs: {picture.path.relative_to(ROOT)}")
        else:
            write(picture.draw, picture.path)
    return 1 if options.check and n_other else 0


if __name__ == "__main__":
    run(main)
