"""Effect of relabelled turns on the learned meta-controller: ``python -m benchmarks.hindsight``.

Options that ended with another goal than the chosen one were learned from as if that goal had been chosen, where their
advantage was positive. `benchmarks/results/hindsight/runs.csv` has a row for each run with it and without it; the code
that did it is gone since, and was that of commit e9b3d53 with a switch. Each evaluation is apart from training, of 100
episodes and at the end of 300.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.paper.runs import mean_and_interval
from benchmarks.study.tables import Row, read_rows
from hierroom.support.tables import markdown_table

HEADINGS = ("graph", "steps", "seeds")
HEADINGS += ("success with", "without", "difference", "length with", "without", "difference")
ROWS = Path(__file__).parent / "results" / "hindsight" / "runs.csv"


def differences(rows: Sequence[Row], graph: str, column: str) -> np.ndarray:
    """Return the column without hindsight minus that with it, of each seed [S]."""
    found = {(row["hindsight"], row["seed"]): float(row[column]) for row in rows if row["graph"] == graph}
    seeds = sorted({seed for _, seed in found})
    return np.array([found["no", seed] - found["yes", seed] for seed in seeds])


def main() -> None:
    """Print the table."""
    rows, lines = read_rows(ROWS), []
    for graph in "defg":
        for share in ("40", "70", "100"):
            own = [row for row in rows if row["graph"] == graph]
            cells = [graph, f"{int(own[0]['steps']) * int(share) // 100:,}", str(len(own) // 2)]
            for name, scale, style in (("success", 100, ".1f"), ("length", 1, ".0f")):
                column, difference = f"{name}_{share}", scale * differences(rows, graph, f"{name}_{share}")
                for arm in ("yes", "no"):
                    mean = np.mean([scale * float(row[column]) for row in own if row["hindsight"] == arm])
                    cells.append(f"{mean:{style}}")
                mean, half = mean_and_interval(difference)
                cells.append(f"{mean:+{style}} ± {half:{style}}")
            lines.append(cells)
    print(markdown_table(HEADINGS, lines))


if __name__ == "__main__":
    main()
