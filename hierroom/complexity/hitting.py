"""First passage of a random walk in discrete time: mean, variance, probability, visits, and sensitivity to each edge.

Every function takes W as described in `hierroom.complexity.weights`, dense or sparse, and returns the exact limit where
an equation has no solution: a node from which the target may never be reached has mean ``inf`` instead of a singular
matrix.

With Q the transition matrix among the nodes that are not targets, I - Q = D - W on those nodes, whatever the
probability to stay; N = (I - Q)^-1 is the fundamental matrix (Kemeny and Snell, Finite Markov Chains, 1960, chapter 3).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from hierroom.complexity.weights import (
    Targets,
    Weights,
    as_moves,
    as_node,
    as_targets,
    can_reach,
    closed_classes,
    n_nodes,
    row_sums,
)


class _Fates(NamedTuple):
    """Disjoint sets of nodes, [n] bool each: the targets, and nodes that surely, possibly or never reach one."""

    target: NDArray[np.bool_]
    sure: NDArray[np.bool_]
    unsure: NDArray[np.bool_]
    lost: NDArray[np.bool_]


def mean_first_passage_time(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Mean number of steps until a target is first reached, including steps that stay.

    m_i = 0 on the targets and sum_j (D - W)_ij m_j = 1 elsewhere, the boundary-value problem of Norris, Markov Chains
    (1997), theorem 1.3.5. The numbers in the paper's Table 2 are different ones: see `laplacian_hitting_time`. The
    relative rounding error is about 1e-16 times the mean itself.

    Args:
        weights: W [n, n], dense or sparse, rows summing to at most one.
        targets: one or several nodes.

    Returns:
        [n] float64, in steps, for each start node; ``inf`` where the target is missed with positive probability.

    Raises:
        InputError: if W or the targets are not valid.
    """
    moves, fates = _prepare(weights, targets)
    means = np.where(fates.target, 0.0, np.inf)
    means[fates.sure] = _solver(moves, fates.sure)(np.ones(fates.sure.sum()))
    return means


def first_passage_variance(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Variance of the number of steps until a target is first reached.

    By the law of total variance over the first step, v_i = sum_j P_ij v_j + sum_j P_ij (m_j + 1 - m_i)^2 with m the
    mean and v = 0 on the targets. This equals (2 N - I) m - m^2 of Kemeny and Snell (theorem 3.3.3) without its
    cancellation.

    Args:
        weights: W [n, n], dense or sparse, rows summing to at most one.
        targets: one or several nodes.

    Returns:
        [n] float64, in steps squared; ``inf`` where the mean is ``inf``.

    Raises:
        InputError: if W or the targets are not valid.
    """
    moves, fates = _prepare(weights, targets)
    variances = np.where(fates.target, 0.0, np.inf)
    solve = _solver(moves, fates.sure)
    means = np.zeros(len(variances))
    means[fates.sure] = solve(np.ones(fates.sure.sum()))
    steps = moves[fates.sure].tocoo()
    own_means = means[fates.sure]
    off_by = steps.data * (means[steps.col] + 1 - own_means[steps.row]) ** 2
    staying = 1 - row_sums(moves)[fates.sure]  # a step that stays differs from the mean by one step
    variances[fates.sure] = solve(staying + np.bincount(steps.row, off_by, len(own_means)))
    return variances


def hitting_probability(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Probability that a target is ever reached.

    h_i = 1 on the targets, h_i = 0 where no target can be reached, and sum_j (D - W)_ij h_j = 0 elsewhere (Norris,
    theorem 1.3.2, the minimal solution). Nodes that cannot miss the targets get exactly one.

    Args:
        weights: W [n, n], dense or sparse, rows summing to at most one.
        targets: one or several nodes.

    Returns:
        [n] float64 in 0..1.

    Raises:
        InputError: if W or the targets are not valid.
    """
    moves, fates = _prepare(weights, targets)
    reached = (fates.target | fates.sure).astype(float)
    if fates.unsure.any():
        into_reached = (moves @ reached)[fates.unsure]
        reached[fates.unsure] = np.clip(_solver(moves, fates.unsure)(into_reached), 0.0, 1.0)
    return reached


def expected_visits(weights: Weights, source: int, targets: Targets) -> NDArray[np.float64]:
    """Expected number of steps spent at each node before a target is first reached.

    v = e_source' N, the source's row of the fundamental matrix, is computed by solving (D - W)' v = e_source on the
    transient nodes. The sum of v is the mean first-passage time.

    Args:
        weights: W [n, n], dense or sparse, rows summing to at most one.
        source: index of the start node.
        targets: one or several nodes.

    Returns:
        [n] float64, in steps; 0 at the targets and at nodes that are not visited before them, ``inf`` at nodes where a
        walk that missed the targets stays for ever.

    Raises:
        InputError: if W, the source or the targets are not valid.
    """
    moves, fates = _prepare(weights, targets)
    n = n_nodes(moves)
    source = as_node(source, n)
    visits = np.zeros(n)
    if fates.target[source]:
        return visits
    visited = can_reach(moves.T.tocsr(), as_targets(source, n), avoid=fates.target)
    caught = visited & fates.lost & as_targets(np.concatenate(closed_classes(moves)), n)
    visits[caught] = np.inf
    transient = visited & ~caught
    if transient[source]:
        at_source = (np.flatnonzero(transient) == source).astype(float)
        visits[transient] = _solver(moves, transient)(at_source, "T")
    return visits


def passage_time_sensitivity(weights: Weights, source: int, targets: Targets) -> sp.csr_array:
    """Derivative of the mean first-passage time with respect to each edge's weight, balanced by the chance to stay.

    dm_s / dW_ij = v_i (m_j - m_i), with v the expected visits from s and m the mean times: at each visit to i, a little
    probability moves from staying at i to going to j. This follows from dN = N dQ N.

    Args:
        weights: W [n, n], dense or sparse, rows summing to at most one.
        source: index of the start node.
        targets: one or several nodes.

    Returns:
        [n, n] float64 CSR with an entry for each edge of W that begins at a node visited before a target, in steps per
        unit of weight; negative where a larger weight shortens the time; ``nan`` throughout if the mean is ``inf``.

    Raises:
        InputError: if W, the source or the targets are not valid.
    """
    means = mean_first_passage_time(weights, targets)
    edges = as_moves(weights).tocoo()
    source = as_node(source, len(means))
    visits = expected_visits(weights, source, targets)
    used = visits[edges.row] > 0
    rows, columns = edges.row[used], edges.col[used]
    with np.errstate(invalid="ignore"):  # inf - inf gives the documented nan
        slopes = visits[rows] * (means[columns] - means[rows])
    if np.isinf(means[source]):
        slopes[:] = np.nan
    return sp.csr_array((slopes, (rows, columns)), shape=edges.shape)


def _prepare(weights: Weights, targets: Targets) -> tuple[sp.csr_array, _Fates]:
    moves = as_moves(weights)
    target = as_targets(targets, n_nodes(moves))
    can = can_reach(moves, target)
    may_miss = can_reach(moves, ~can, avoid=target)
    return moves, _Fates(target, can & ~may_miss & ~target, can & may_miss & ~target, ~can)


def _solver(moves: sp.csr_array, among: NDArray[np.bool_]) -> Callable[..., NDArray[np.float64]]:
    """A solver of (D - W) x = b on nodes that the walk surely leaves; with ``"T"`` it solves the transposed system."""
    if not among.any():
        return lambda b, trans="N": np.asarray(b, float)
    system = sp.diags_array(row_sums(moves)[among]) - moves[among][:, among]
    return splu(system.tocsc()).solve
