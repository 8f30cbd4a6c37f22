"""The paper's tables and figures: ``python -m hierroom paper table3``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import tyro

from hierroom.lab.paper.figures import All, Figure3, Figure4, Figure5
from hierroom.lab.paper.table2 import Table2
from hierroom.lab.paper.table3 import Table3
from hierroom.support.cli import read_arguments


@dataclass(frozen=True)
class PaperArguments:
    """Print or draw the paper's tables and figures, with our numbers next to the paper's."""

    part: tyro.conf.OmitSubcommandPrefixes[
        tyro.conf.OmitArgPrefixes[Table2 | Table3 | Figure3 | Figure4 | Figure5 | All]
    ]


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    read_arguments(PaperArguments, "paper", argv).part.run()
    return 0
