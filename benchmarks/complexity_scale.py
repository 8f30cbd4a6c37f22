"""Cost of a complexity report against the number of nodes, next to deeptime's and a dense numpy solve.

    python benchmarks/complexity_scale.py

Every row is the hardest graph of its number of rooms for us: a star, with drop. Each time is the median of some repeats
after a warm-up, with the spread from the least to the greatest; peak memory is measured in a process of its own.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import deeptime
import numpy as np
import scipy.sparse as sp
import tyro
from deeptime.markov.tools.analysis import mfpt
from rich.console import Console
from rich.table import Table

from hierroom.complexity import analyze, mean_first_passage_time
from hierroom.goals import GoalGraph
from hierroom.runs.folder.provenance import cpu_name


@dataclass(frozen=True)
class Options:
    """Time complexity reports of stars of 2 to 12 rooms."""

    max_rooms: int = 10
    """Most rooms."""
    repeats: int = 5
    """Times each is measured."""
    max_dense_nodes: int = 1100
    """Beyond so many nodes the dense solve, cubic in time and quadratic in memory, is left out."""


def star(n_rooms: int) -> GoalGraph:
    return GoalGraph((0,) * (n_rooms - 1), 1)


def whole_report(n_rooms: int) -> dict:
    return analyze(star(n_rooms), drop_key=True).to_dict()


def dense_hitting_time(weights: np.ndarray) -> float:
    b = np.zeros(len(weights))
    b[0], b[-1] = 1, -1
    return float(b @ np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights) @ b)


def measure(run: Callable[[], object], repeats: int) -> str:
    run()
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - started)
    scale, unit = (1e3, "ms") if np.median(seconds) < 1 else (1, "s")
    low, middle, high = (scale * f(seconds) for f in (min, np.median, max))
    return f"{middle:.1f} {unit} ({low:.1f}-{high:.1f})"


def peak_megabytes(n_rooms: int) -> str:
    code = (
        "import resource; from hierroom.complexity import analyze; from hierroom.goals import GoalGraph; "
        f"analyze(GoalGraph((0,) * {n_rooms - 1}, 1), drop_key=True).to_dict(); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"
    )
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def row(n_rooms: int, options: Options) -> list[str]:
    report = analyze(star(n_rooms), drop_key=True)
    weights, exit_node, n = report.chain.weights, report.augmented.exit, report.nodes
    chances = sp.csr_array(weights + sp.diags_array(1 - weights.sum(axis=1)))
    theirs, ours = np.asarray(mfpt(chances, [exit_node]))[0], report.expected_steps
    assert np.isclose(theirs, ours, rtol=1e-9), (theirs, ours)
    cells = [
        str(n_rooms),
        str(n),
        measure(lambda: whole_report(n_rooms), options.repeats),
        peak_megabytes(n_rooms),
        measure(lambda: analyze(star(n_rooms), drop_key=True).hitting_time, options.repeats),
        measure(lambda: mean_first_passage_time(weights, exit_node), options.repeats),
        measure(lambda: mfpt(chances, [exit_node]), options.repeats),
    ]
    if n <= options.max_dense_nodes:
        dense = weights.toarray()
        assert np.isclose(dense_hitting_time(dense), report.hitting_time, rtol=1e-9)
        cells.append(measure(lambda: dense_hitting_time(dense), options.repeats))
    else:
        cells.append("-")
    return cells


def main(options: Options) -> None:
    table = Table(
        title=f"{cpu_name()}, one thread, Python {platform.python_version()}, "
        f"numpy {np.__version__}, deeptime {deeptime.__version__}; median of {options.repeats} (least-greatest)"
    )
    for heading in (
        "rooms",
        "nodes",
        "whole report",
        "its process, MB",
        "graph and hitting time",
        "mean passage: ours",
        "mean passage: deeptime",
        "hitting time: dense pinv",
    ):
        table.add_column(heading, justify="right")
    for n_rooms in range(2, options.max_rooms + 1):
        table.add_row(*row(n_rooms, options))
    Console(width=170).print(table)


if __name__ == "__main__":
    main(tyro.cli(Options))
