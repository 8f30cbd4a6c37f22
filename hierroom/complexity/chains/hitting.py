"""First passage of a random walk in discrete time: mean, variance, probability, visits, and sensitivity to each edge.

Every function takes W [n, n] as in `chains.weights`, with rows that sum to at most one, targets (one or several nodes)
and perhaps a source, the start node. A mean is ``inf`` where the target may never be reached, so that the
equation has no solution. Q is the transition matrix among the nodes that are not targets; on them, I - Q = D - W. N =
(I - Q)^-1 is the fundamental matrix (Kemeny and Snell, Finite Markov Chains, 1960, chapter 3). Systems are solved
without subtraction (`chains.elimination`), so each entry has a small relative error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from hierroom.complexity.chains.elimination import TOO_LONG, Elimination
from hierroom.complexity.chains.weights import (
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
from hierroom.support.errors import InputError

LONG = 1e150
"""The squares of larger numbers of steps may overflow a float."""


class _Fates(NamedTuple):
    """Disjoint sets of nodes, [n] bool each: the targets, and nodes that surely, possibly or never reach one."""

    target: NDArray[np.bool_]
    sure: NDArray[np.bool_]
    unsure: NDArray[np.bool_]
    lost: NDArray[np.bool_]


def mean_first_passage_time(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Return the mean steps [n], staying included, until a target is first reached; ``inf`` where it may be missed.

    m_i = 0 on the targets and sum_j (D - W)_ij m_j = 1 elsewhere, the boundary-value problem of Norris, Markov Chains
    (1997), theorem 1.3.5. The paper's Table 2 has other numbers: see `laplacian_hitting_time`.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.mean_first_passage_time(W, targets=2).round(3).tolist()
        [6.0, 4.0, 0.0]
    """
    moves, fates = _prepare(weights, targets)
    means = np.where(fates.target, 0.0, np.inf)
    means[fates.sure] = _finite(_system(moves, fates.sure).solve(np.ones(fates.sure.sum())))
    return means


def first_passage_variance(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Return the variance [n] of the steps until a target is first reached; ``inf`` if a mean is above 10^150.

    It is the second moment N (2 m - 1) minus m^2, with the means m, which equals (2 N - I) m - m^2 (Kemeny and Snell,
    theorem 3.3.3). Rounding may add about 10^-16 m^2.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.first_passage_variance(W, targets=2).round(3).tolist()
        [22.0, 20.0, 0.0]
    """
    moves, fates = _prepare(weights, targets)
    variances = np.where(fates.target, 0.0, np.inf)
    system = _system(moves, fates.sure)
    own = _finite(system.solve(np.ones(fates.sure.sum())))
    if own.max(initial=0.0) <= LONG:
        variances[fates.sure] = np.maximum(system.solve(2 * own - 1) - own**2, 0.0)
    return variances


def hitting_probability(weights: Weights, targets: Targets) -> NDArray[np.float64]:
    """Return the probability [n] that a target is ever reached.

    h_i = 1 on the targets, h_i = 0 where no target can be reached, and sum_j (D - W)_ij h_j = 0 elsewhere (Norris,
    theorem 1.3.2, the minimal solution). Nodes that cannot miss the targets get exactly one.

    Examples:
        >>> W = [[0.5, 0.25, 0.25], [0, 1, 0], [0, 0, 1]]
        >>> hierroom.complexity.hitting_probability(W, targets=2).tolist()
        [0.5, 0.0, 1.0]
    """
    moves, fates = _prepare(weights, targets)
    reached = (fates.target | fates.sure).astype(float)
    if fates.unsure.any():
        into_reached = (moves @ reached)[fates.unsure]
        reached[fates.unsure] = np.minimum(_system(moves, fates.unsure).solve(into_reached), 1.0)
    return reached


def expected_visits(weights: Weights, source: int, targets: Targets) -> NDArray[np.float64]:
    """Return the expected steps [n] spent at each node before a target is first reached; their sum is the mean.

    v = e_source' N, the source's row of the fundamental matrix, solves (D - W)' v = e_source on the transient nodes.
    It is ``inf`` at nodes of a class without a target that the walk may enter but never leaves.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.expected_visits(W, source=0, targets=2).round(3).tolist()
        [4.0, 2.0, 0.0]
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
        visits[transient] = _finite(_system(moves, transient).solve_transposed(at_source))
    return visits


def passage_time_sensitivity(weights: Weights, source: int, targets: Targets) -> sp.csr_array:
    """Return the derivative [n, n] CSR of the mean first-passage time by each edge's weight, at the cost of staying.

    dm_s / dW_ij = v_i (m_j - m_i), where v are the expected visits from s and m the mean times. It follows from
    dN = N dQ N, where a little probability changes from staying at i to going to j. Only edges from nodes that are
    visited before a target have an entry; all are ``nan`` if the mean is ``inf``.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.passage_time_sensitivity(W, source=0, targets=2).toarray().round(3).tolist()
        [[0.0, -8.0, 0.0], [4.0, 0.0, -8.0], [0.0, 0.0, 0.0]]
    """
    moves, fates = _prepare(weights, targets)
    source = as_node(source, n_nodes(moves))
    visits, edges = expected_visits(weights, source, np.flatnonzero(fates.target)), moves.tocoo()
    used = visits[edges.row] > 0
    rows, columns = edges.row[used], edges.col[used]
    if fates.unsure[source] or fates.lost[source]:
        slopes = np.full(len(rows), np.nan)
    else:
        ahead = _means_less_the_sources(moves, fates, source, visits.sum())
        slopes = visits[rows] * (ahead[columns] - ahead[rows])
    return sp.csr_array((slopes, (rows, columns)), shape=edges.shape)


def _means_less_the_sources(moves: sp.csr_array, fates: _Fates, source: int, mean: float) -> NDArray[np.float64]:
    """Return m_i - m_s [n] for the targets and the nodes that surely reach one; m_s is ``mean``.

    If a walk restarts, means of 10^18 steps may differ by a few steps, which their floats lose. So a walk from i is
    followed only until it reaches s or a target: m_i - m_s = (steps until then) - (probability of a target) m_s.
    """
    others = fates.sure.copy()
    others[source] = False
    system = _system(moves, others)
    steps, chances = np.zeros(len(others)), fates.target.astype(float)
    chances[others] = system.solve((moves @ chances)[others])
    steps[others] = system.solve(np.ones(others.sum()))
    return steps - chances * mean


def _prepare(weights: Weights, targets: Targets) -> tuple[sp.csr_array, _Fates]:
    moves = as_moves(weights)
    target = as_targets(targets, n_nodes(moves))
    can = can_reach(moves, target)
    may_miss = can_reach(moves, ~can, avoid=target)
    return moves, _Fates(target, can & ~may_miss & ~target, can & may_miss & ~target, ~can)


def _finite(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    if not np.isfinite(steps).all():
        raise InputError(TOO_LONG)
    return steps


def _system(moves: sp.csr_array, among: NDArray[np.bool_]) -> Elimination:
    rows = moves[among]
    return Elimination(rows[:, among], row_sums(rows[:, ~among]))
