"""Does a number computed from the goal graph, before anybody trains, say how long training will take?

    python benchmarks/prediction.py benchmarks/results/hippo.csv --draw docs/prediction.png

For each method of a table that `success.py` made: Spearman's rank correlation, over the graphs, between each measure of
complexity and the median number of steps to 95% success. 1 says that the measure ranks the graphs as training does; a
graph on which 95% was not reached ranks last.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median

import tyro
from matplotlib.figure import Figure
from run_table import read
from scipy.stats import spearmanr

from hierroom.cli import run
from hierroom.complexity import analyze
from hierroom.errors import InputError

MEASURES = ("exit_depth", "width", "hitting_time", "expected_steps")
SETTINGS = ("preset", "meta", "size", "drop_key", "steps")
"""What all rows of a method must have in common."""
FEWEST_GRAPHS = 4
"""Fewer can be ranked alike by chance."""


@dataclass(frozen=True)
class Options:
    """Compare what was computed with what was trained."""

    table: tyro.conf.Positional[Path]
    """A CSV file made by success.py."""
    draw: Path | None = None
    """Where to draw expected steps against training steps; the ending chooses the format."""


def training_steps(rows: list[dict[str, str]]) -> dict[str, dict[str, float]]:
    """Method to graph to the median number of steps to 95%, infinite where it was not reached.

    Raises:
        InputError: if these are not rows of a table that `success.py` made, or a method's differ in their settings.
    """
    missing = {"method", "graph", "steps_to_95", *SETTINGS}.difference(*rows[:1])
    if missing:
        raise InputError(f"this is no table of success.py: it has no rows with {', '.join(sorted(missing))}")
    for setting in SETTINGS:
        found = {(row["method"], row[setting]) for row in rows}
        if len(found) > len({method for method, _ in found}):
            raise InputError(f"rows of one method differ in {setting}: {', '.join(sorted({v for _, v in found}))}")
    by_method: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        of_graph = by_method.setdefault(row["method"], {}).setdefault(row["graph"], [])
        of_graph.append(float(row["steps_to_95"] or "inf"))
    return {
        method: {graph: median(steps) for graph, steps in sorted(graphs.items())}
        for method, graphs in by_method.items()
        if len(graphs) >= FEWEST_GRAPHS
    }


def print_correlations(trained: dict[str, dict[str, float]]) -> None:
    """Print a line for each method: how well each measure ranks its graphs."""
    print("| method | graphs | exit depth | width | hitting time, paper's | expected steps, true |")
    print("|---|---|---|---|---|---|")
    for method, steps in trained.items():
        reports = [analyze(graph) for graph in steps]
        correlations = [
            spearmanr([getattr(report, measure) for report in reports], list(steps.values()))[0] for measure in MEASURES
        ]
        print(f"| {method} | {len(steps)} | " + " | ".join(f"{rho:.2f}" for rho in correlations) + " |")


def draw(trained: dict[str, dict[str, float]], path: Path) -> None:
    """Draw training steps against expected steps, a mark for each graph; those never solved are left out."""
    figure = Figure(figsize=(5, 3.6), layout="constrained")
    axes = figure.subplots()
    for method, steps in trained.items():
        points = [(analyze(graph).expected_steps, value / 1e6, graph) for graph, value in steps.items()]
        solved = [point for point in points if point[1] < float("inf")]
        axes.scatter([x for x, _, _ in solved], [y for _, y, _ in solved], label=method)
        for x, y, graph in solved:
            axes.annotate(Path(graph).stem, (x, y), textcoords="offset points", xytext=(5, -3))
    axes.set_xlabel("expected steps of a random walk on the goal graph")
    axes.set_ylabel("training steps to 95% (millions)")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(frameon=False, loc="outside upper left", ncols=len(trained))
    try:
        figure.savefig(path, dpi=150)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot draw to {path}: {error}") from error


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    trained = training_steps(read(options.table))
    if not trained:
        raise InputError(f"{options.table} has no method with {FEWEST_GRAPHS} graphs or more")
    print_correlations(trained)
    if options.draw:
        draw(trained, options.draw)
    return 0


if __name__ == "__main__":
    run(main)
