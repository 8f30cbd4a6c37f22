"""The paper's hitting time: the sparse least-squares solution of a singular Laplacian system.

The paper (section 2.1) sets L = W - D and asks for x with L x = b and x_t = 0, where b_s = 1 and b_t = -1. It calls x_s
the hitting time. No x solves this system, because L is singular and b is not in its range. The least-squares solution
x = pinv(L) b reproduces Table 2. It gives

    hitting time = b' pinv(D - W) b                                                                              (1)

(the sign of L is dropped; adding a constant to x so that x_t = 0 changes nothing, because b sums to zero). This is not
the mean first-passage time: on graph a it is 8.36, while the mean is 28 steps.

**What it measures.** The paper's exit has one edge, of weight r = 0.01, back to the start. If the target's only edge
leads to the source, row t of the least-squares equations is r (x_t - x_s) = -1 - y_t (y_s - y_t) / |y|^2. Here y is the
stationary distribution of the walk, up to a factor. In each cycle through the exit, the walk spends 1 / r steps there
and v_i steps at each other node i: the `expected_visits` before the exit is reached. So y = (v, 1 / r) and

    hitting time = (v_s + r |v|^2) / (1 + r^2 |v|^2).                                                            (2)

The mean first-passage time is the sum of v, while this number depends on squares. As |v|^2 grows, it tends to 1 / r =
100 on any graph: it is 98.7 for a chain of 8 rooms with a mean of 1,656 steps, and 100.0 for 20 rooms with 6.7 million.
It is above 100 exactly if more than 100 steps are spent at the start, and falls again as graphs get harder; with drop
and 7 rooms it is at most 113. Use the mean to compare hard graphs.

**Sparse solution.** Let K = D - W. Its left null space is spanned by one vector y_c for each closed class c of the
walk, zero outside the class. Its right null space is spanned by the h_c, the probabilities to end in class c. Hence

    1. b^ = b - sum_c y_c (y_c' b) / (y_c' y_c)        the part of b in the range of K: least squares,
    2. K x = b^, with x = 0 at one node of each class  regular: solved by elimination without subtraction,
    3. x - H (H' H)^-1 H' x, with columns h_c          the solution of least norm.

Step 2 must not choose nodes that are seldom visited: x would then be much larger than its differences.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from hierroom.complexity.chains.elimination import Elimination
from hierroom.complexity.chains.weights import (
    Weights,
    as_node,
    as_targets,
    as_weights,
    can_reach,
    closed_classes,
    n_nodes,
    row_sums,
)
from hierroom.support.errors import InputError

Vector = NDArray[np.float64]
RARE = 1e-3
"""A node is rare if it is visited less than this fraction as often as another node of its class."""


def laplacian(weights: Weights) -> sp.csr_array:
    """Return the graph Laplacian L = W - D, [n, n] CSR, where D holds the row sums of W (paper, section 2.1).

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.laplacian(W).toarray().tolist()
        [[-0.5, 0.5, 0.0], [0.5, -1.0, 0.5], [0.0, 0.0, 0.0]]
    """
    matrix = as_weights(weights)
    return sp.csr_array(matrix - sp.diags_array(row_sums(matrix)))


def laplacian_hitting_time(weights: Weights, source: int, target: int) -> float:
    """Return the paper's hitting time (Table 2): b' pinv(D - W) b, b = e_source - e_target; ``inf`` without a path.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> round(hierroom.complexity.laplacian_hitting_time(W, source=0, target=2), 3)
        4.0
    """
    matrix = as_weights(weights)
    n = n_nodes(matrix)
    source, target = as_node(source, n), as_node(target, n)
    if source == target:
        return 0.0
    if not can_reach(matrix, as_targets(target, n))[source]:
        return np.inf
    # the pseudo-inverse of a block-diagonal matrix is blockwise, so only the source's connected component matters
    part = _part_of(matrix, source)
    source, target = (int(np.searchsorted(part, node)) for node in (source, target))
    inverse = LaplacianInverse(matrix[part][:, part])
    with np.errstate(over="ignore", invalid="ignore"):
        x = inverse.apply(_difference(len(part), source, target))
        return float(_finite(x[source] - x[target]))


def laplacian_sensitivity(weights: Weights, source: int, target: int) -> sp.csr_array:
    """Return the derivative [n, n] CSR of the paper's hitting time by each edge's weight; ``nan`` if it is ``inf``.

    Let K = D - W, x = pinv(K) b, z = pinv(K') b, r = b - K x and u = pinv(K) z. With dK / dW_ij = e_i (e_i - e_j)',
    the derivative of a pseudo-inverse of constant rank (Golub and Pereyra, 1973, theorem 4.3) gives

        d(b' pinv(K) b) / dW_ij = -z_i (x_i - x_j) + r_i (u_i - u_j).

    Where the walk may end in one of several closed classes, x_s - x_t also depends on their h_c, and this formula holds
    only if the walk surely reaches the target.

    Args:
        weights: W [n, n]. Unless the source surely reaches the target, its connected component has one closed class, as
            in any walk that restarts.
        source: index of the start node.
        target: index of the goal node.

    Examples:
        >>> W = [[0, 1, 0], [0.5, 0, 0.5], [1, 0, 0]]
        >>> hierroom.complexity.laplacian_sensitivity(W, source=0, target=2).toarray().round(3).tolist()
        [[0.0, -0.123, 0.0], [0.123, 0.0, 0.074], [-1.086, 0.0, 0.0]]
    """
    whole = as_weights(weights)
    n = n_nodes(whole)
    source, is_target = as_node(source, n), as_targets(target, n)
    part = _part_of(whole, source)
    matrix = whole[part][:, part]
    edges = matrix.tocoo()
    i, j = edges.row, edges.col
    can = can_reach(whole, is_target)
    if not can[source]:
        return sp.csr_array((np.full(len(i), np.nan), (part[i], part[j])), shape=(n, n))
    n_classes = len(closed_classes(matrix))
    if n_classes > 1 and can_reach(whole, ~can, avoid=is_target)[source]:
        raise InputError(
            "the sensitivity of the Laplacian hitting time needs a walk that surely reaches the target or ends in a "
            f"single part of the graph, but it may miss the target, and W has {n_classes} parts that are never left"
        )
    inverse = LaplacianInverse(matrix)
    b = _difference(n, source, target)[part]
    with np.errstate(over="ignore", invalid="ignore"):
        x, z = inverse.apply(b), inverse.apply_transposed(b)
        u, residual = inverse.apply(z), b - inverse.project(b)
        slopes = _finite(-z[i] * (x[i] - x[j]) + residual[i] * (u[i] - u[j]))
    return sp.csr_array((slopes, (part[i], part[j])), shape=(n, n))


class LaplacianInverse:
    """Applies pinv(D - W). D - W is regular without the row and column of one node of each closed class, its pin."""

    def __init__(self, weights: sp.csr_array) -> None:
        classes = closed_classes(weights)
        left = self._pin(weights, classes, [int(nodes[0]) for nodes in classes])
        if (left.max(axis=0) * RARE > 1).any():  # left is 1 at the pins and grows with the visits of a node
            left = self._pin(weights, classes, left.argmax(axis=0).tolist())
        self._left = _finite(left) / np.linalg.norm(left, axis=0)
        # the h_c [n, C] with (D - W) h_c = 0, scaled to 1 at the pins
        self._right = np.column_stack([self._solve(weights[:, [pin]].toarray().ravel()) for pin in self._pins])
        self._right[self._pins, np.arange(len(self._pins))] = 1.0

    def project(self, b: Vector) -> Vector:
        """Return the part of b in the range of D - W."""
        return b - self._left @ (self._left.T @ b)

    def apply(self, b: Vector) -> Vector:
        """Return pinv(D - W) b, the least-squares solution of least norm."""
        return self._without_right_null(self._solve(self.project(b)))

    def apply_transposed(self, b: Vector) -> Vector:
        """Return pinv(D - W)' b: like `apply`, with the two null spaces exchanged."""
        return self.project(self._solve_transposed(self._without_right_null(b)))

    def _without_right_null(self, x: Vector) -> Vector:
        return x - self._right @ np.linalg.solve(self._right.T @ self._right, self._right.T @ x)

    def _pin(self, weights: sp.csr_array, classes: list[NDArray[np.int64]], pins: list[int]) -> Vector:
        """Set the pins, and return the y_c [n, C] with y_c' (D - W) = 0, scaled to 1 at the pins."""
        self._pins, self._free = pins, np.setdiff1d(np.arange(n_nodes(weights)), pins)
        rows = weights[self._free]
        self._factors = Elimination(rows[:, self._free], row_sums(rows[:, pins]))
        left = np.zeros((n_nodes(weights), len(classes)))
        for c, (pin, nodes) in enumerate(zip(pins, classes, strict=True)):
            left[nodes, c] = self._solve_transposed(weights[[pin]].toarray().ravel())[nodes]
            left[pin, c] = 1.0
        return left

    def _solve(self, b: Vector) -> Vector:
        """Return the solution x of (D - W) x = b at all nodes but the pins, where x is 0."""
        x = np.zeros(len(b))
        x[self._free] = self._factors.solve(b[self._free])
        return x

    def _solve_transposed(self, b: Vector) -> Vector:
        x = np.zeros(len(b))
        x[self._free] = self._factors.solve_transposed(b[self._free])
        return x


def _part_of(weights: sp.csr_array, node: int) -> NDArray[np.int64]:
    labels = connected_components(weights, directed=False)[1]
    return np.flatnonzero(labels == labels[node])


def _finite(values: Any) -> Any:
    if not np.isfinite(values).all():
        raise InputError("the weights of W differ so much that 64-bit floats cannot hold the solution")
    return values


def _difference(n: int, source: int, target: int) -> Vector:
    return (np.arange(n) == source).astype(float) - (np.arange(n) == target)
