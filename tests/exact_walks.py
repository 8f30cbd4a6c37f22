"""First passage in exact fractions, the reference for elimination in floats. Weights are taken as exact floats."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray


def laplacian_exactly(weights: NDArray[np.float64]) -> list[list[Fraction]]:
    """D - W in fractions, D being the sums of W's rows."""
    exact = [[Fraction(value) for value in row] for row in weights.tolist()]
    return [[sum(row) * (i == j) - value for j, value in enumerate(row)] for i, row in enumerate(exact)]


def solve_exactly(matrix: Sequence[Sequence[Fraction | int]], right: Sequence[Fraction | int]) -> list[Fraction]:
    """The solution of a system of equations by elimination in fractions."""
    rows = [[*map(Fraction, row), Fraction(value)] for row, value in zip(matrix, right, strict=True)]
    for column in range(len(rows)):
        pivot = next(r for r in range(column, len(rows)) if rows[r][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [value / rows[column][column] for value in rows[column]]
        for r in range(len(rows)):
            if r != column and (factor := rows[r][column]):
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[column], strict=True)]
    return [row[-1] for row in rows]


def passage_exactly(weights: NDArray[np.float64], target: int) -> tuple[list[Fraction], list[Fraction]]:
    """Mean and variance of the first-passage time to the target from each node, in fractions: ([n], [n])."""
    walking = [i for i in range(len(weights)) if i != target]
    laplacian = laplacian_exactly(weights)
    within = [[laplacian[i][j] for j in walking] for i in walking]
    means = solve_exactly(within, [1] * len(walking))
    squares = solve_exactly(within, [2 * mean - 1 for mean in means])
    variances = [square - mean**2 for square, mean in zip(squares, means, strict=True)]
    means.insert(target, Fraction(0))
    variances.insert(target, Fraction(0))
    return means, variances
