"""First passage in exact fractions, the reference for elimination in floats. Weights are taken as exact floats."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray


def solve_exactly(weights: NDArray[np.float64], target: int, right: list[Fraction]) -> list[Fraction]:
    """The solution x of (D - W) x = right, x = 0 at the target, by elimination in fractions."""
    n = len(weights)
    rows = {
        i: {j: Fraction(float(weights[i, j])) for j in np.flatnonzero(weights[i]).tolist() if j != i}
        for i in range(n)
        if i != target
    }
    right, order = [Fraction(0) if i == target else value for i, value in enumerate(right)], sorted(rows, reverse=True)
    for position, k in enumerate(order):
        rate = sum(rows[k].values())
        rows[k] = {j: weight / rate for j, weight in rows[k].items()}
        right[k] /= rate
        for i in order[position + 1 :]:
            into = rows[i].pop(k, 0)
            for j, weight in rows[k].items():
                if into and j != i:
                    rows[i][j] = rows[i].get(j, Fraction(0)) + into * weight
            right[i] += into * right[k]
    for i in reversed(order):
        right[i] += sum((weight * right[j] for j, weight in rows[i].items()), Fraction(0))
    return right


def passage_exactly(weights: NDArray[np.float64], target: int) -> tuple[list[Fraction], list[Fraction]]:
    """Mean and variance of the first-passage time to the target from each node, in fractions: ([n], [n])."""
    means = solve_exactly(weights, target, [Fraction(1)] * len(weights))
    squares = solve_exactly(weights, target, [2 * mean - 1 for mean in means])
    return means, [square - mean**2 for square, mean in zip(squares, means, strict=True)]
