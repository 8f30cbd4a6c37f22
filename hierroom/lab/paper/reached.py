"""The methods side by side where one of ours first has the paper's success: at the end most have learned everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hierroom.lab.paper.cells import LIMIT, ComparedCell, Curves, curve_of
from hierroom.lab.paper.runs import cell, mean_and_interval
from hierroom.lab.sweep.table import Row

REFERENCES = ("hippo", "ppo")
"""The methods at whose steps to the paper's success all are compared: the paper's best, and its best flat one."""


def cells_where_reached(
    cells: Sequence[ComparedCell], rows: Sequence[Row], curves: Curves, reference: str
) -> list[ComparedCell]:
    """The cells as they were after so many steps as the median of one method's seeds took to the paper's success.

    Success and length are interpolated between the evaluations of the learning curves.

    Args:
        cells: of one grid size, at the end.
        rows: of the sweep.
        curves: the learning curves by the digests of their rows.
        reference: the method.

    Returns:
        the cells of the graphs on which the method reached the paper's success, if that is high enough to be told.
    """
    steps = {one.graph: one.steps_to_paper for one in cells if one.method == reference}
    earlier = []
    for one in cells:
        at = steps.get(one.graph, np.inf)
        if np.isfinite(at):
            runs = cell(rows, one.method, one.graph, one.size)
            success, success_width = mean_and_interval(values_at(at, runs, curves, "success_rate") * 100)
            length, length_width = mean_and_interval(values_at(at, runs, curves, "length") * 100 / LIMIT)
            numbers = {"success": success, "success_half_width": success_width}
            numbers |= {"length": length, "length_half_width": length_width}
            earlier.append(replace(one, **{name: float(value) for name, value in numbers.items()}))
    return earlier


def values_at(at: float, runs: Sequence[Row], curves: Curves, name: str) -> np.ndarray:
    """[S] a quantity of runs after so many training steps."""
    points = [[(float(point["steps"]), float(point[name])) for point in curve_of(run, curves)] for run in runs]
    return np.array([np.interp(at, *np.array(curve).T) for curve in points])
