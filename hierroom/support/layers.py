"""Places of nodes in layers, so that arrows lead from layer to layer, and long ones pass between the nodes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

APART, BETWEEN, ROUTE = 12.0, (18.0, 36.0), 4.0
"""Distance of neighbours, least and greatest distance of layers, and the width that a passing arrow takes."""
SWEEPS = 24

Point = tuple[float, float]
Edge = tuple[int, int]


class Layout(NamedTuple):
    """Place a graph on a sheet; x grows to the right and y downwards, both from 0."""

    places: list[Point]  # centre of each node
    routes: dict[Edge, list[Point]]  # the points that the arrow of each edge visits: see `Sheet.arrow`
    size: Point


def place_layers(
    sizes: Sequence[Point], layers: Sequence[float], edges: Iterable[Edge], is_down: bool | None = None
) -> Layout:
    """Place nodes in layers, from the top down or from the left to the right, each near its neighbours.

    Args:
        sizes: width and height of each node.
        layers: layer of each node, in any numbers; ``inf`` is the last.
        edges: pairs of different nodes; those to an earlier layer have no route.
        is_down: whether layers are below each other; None: whatever gives the smaller picture.
    """
    ranks = np.unique(layers, return_inverse=True)[1]
    onward = sorted({(i, j) for i, j in edges if ranks[i] <= ranks[j]})
    directions = (True, False) if is_down is None else (is_down,)
    return min((_place(sizes, ranks, onward, one) for one in directions), key=lambda layout: max(layout.size))


def _place(sizes: Sequence[Point], ranks: np.ndarray, onward: list[Edge], is_down: bool) -> Layout:
    breadth, depth = ([size[side] for size in sizes] for side in ((0, 1) if is_down else (1, 0)))
    rows = [np.flatnonzero(ranks == rank).tolist() for rank in range(max(ranks) + 1)]
    before, after, ways = defaultdict(list), defaultdict(list), {}
    for i, j in onward:  # an arrow has a place of its own in each layer that it passes
        passed = range(ranks[i] + 1, ranks[j])
        ways[i, j] = [i, *range(len(breadth), len(breadth) + len(passed)), j]
        for node, rank in zip(ways[i, j][1:-1], passed, strict=True):
            rows[rank].append(node)
            breadth.append(ROUTE)
        for one, other in pairwise(ways[i, j] if ranks[i] < ranks[j] else ()):
            after[one].append(other)
            before[other].append(one)
    at = _positions(rows, breadth, before, after)
    thick = np.array([max(depth[node] for node in row if node < len(depth)) for row in rows])
    aside = [max((abs(at[one] - at[node]) for node in row for one in after[node]), default=0.0) for row in rows]
    starts = np.cumsum([0.0, *(thick + np.clip(np.array(aside) / 3, *BETWEEN))])  # far aside takes space to bend
    middles, halves = starts[ranks] + thick[ranks] / 2, np.array(depth) / 2

    def point(node: int, along: float) -> Point:
        return (at[node], float(along)) if is_down else (float(along), at[node])

    routes = {}
    for (i, j), way in ways.items():
        passed = np.linspace(ranks[i], ranks[j], len(way)).astype(int)
        ends = np.stack([starts[passed] - ROUTE, starts[passed] + thick[passed] + ROUTE], axis=1)
        ends[0, 0], ends[-1, 1] = middles[i] + halves[i], middles[j] - halves[j]
        if ranks[i] == ranks[j]:  # out of one node and into the other on the same side
            ends[-1] = ends[0, 1], middles[j] + halves[j]
        routes[i, j] = [point(node, end) for node, both in zip(way, ends, strict=True) for end in both]
    size = max(at[node] + breadth[node] / 2 for row in rows for node in row), float(max(middles + halves))
    return Layout([point(*one) for one in enumerate(middles)], routes, size if is_down else (size[1], size[0]))


def _positions(
    rows: list[list[int]], breadth: list[float], before: Mapping[int, list[int]], after: Mapping[int, list[int]]
) -> list[float]:
    """Order the nodes of each layer, and return their positions along it, from 0."""
    at = [0.0] * len(breadth)
    for sweep in range(SWEEPS):
        is_ordering, is_onward = sweep < SWEEPS // 2, sweep % 2 == 0
        for row in rows if is_onward else rows[::-1]:
            wanted = {}
            for node in row:
                beside = (before if is_onward else after)[node] if is_ordering else before[node] + after[node]
                wanted[node] = float(np.mean([at[one] for one in beside])) if beside else at[node]
            if is_ordering:
                row.sort(key=wanted.__getitem__)
            least = np.cumsum([0.0, *((breadth[one] + breadth[other]) / 2 + APART for one, other in pairwise(row))])
            fitted = isotonic_regression(np.array([wanted[node] for node in row]) - least).x + least
            for node, position in zip(row, fitted.tolist(), strict=True):
                at[node] = position
    start = min(at[node] - breadth[node] / 2 for row in rows for node in row)
    return [position - start for position in at]
