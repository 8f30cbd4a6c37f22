"""The paper's tables and figures, with our numbers next to the paper's.

    python -m benchmarks.paper table2    # also table3, figure3, figure4, figure5, or all

All but `table2` first train the runs that are missing.
"""

from __future__ import annotations

import tyro

from benchmarks.paper.figures import All, Figure3, Figure4, Figure5
from benchmarks.paper.table2 import Table2
from benchmarks.paper.table3 import Table3
from hierroom.support.cli import run


def main() -> int:
    """Run the command."""
    parts = tyro.conf.OmitArgPrefixes[Table2 | Table3 | Figure3 | Figure4 | Figure5 | All]
    tyro.cli(parts, prog="python -m benchmarks.paper", description=__doc__).run()
    return 0


if __name__ == "__main__":
    run(main)
