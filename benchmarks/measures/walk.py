"""The long run of random walks: stationary distribution, mixing, commute and cover times, committor.

Every function takes W as described in `hierroom.complexity.chains.weights`; P is W with the probability to stay on its
diagonal. Numbers refer to Levin and Peres, Markov Chains and Mixing Times, 2nd edition, 2017.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import eigs

from hierroom.complexity.chains.hitting import expected_visits, hitting_probability, mean_first_passage_time
from hierroom.complexity.chains.weights import (
    Targets,
    Weights,
    as_moves,
    as_node,
    as_targets,
    closed_classes,
    n_nodes,
    row_sums,
    with_staying,
)
from hierroom.support.errors import InputError, require_number

MAX_DENSE_NODES = 2000
"""With more nodes, eigenvalues are found iteratively, and the mixing time is refused, as it takes dense powers of P."""
MAX_COVER_NODES = 14
"""Most nodes for an exact cover time; its cost doubles with every node."""


def stationary_distribution(weights: Weights) -> NDArray[np.float64]:
    """Return the long-run fraction [n] of the time that a walk spends at each node, pi P = pi; 0 at transient nodes.

    Between two visits to one node s of the recurrent class, a walk spends an expected v_i steps at i, and
    pi_i = v_i / sum v (proposition 1.14). This needs no eigenvector, and it has a small relative error even at nodes
    that are seldom visited.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
    """
    moves = as_moves(weights)
    classes, n = closed_classes(moves), n_nodes(moves)
    if len(classes) > 1:
        raise InputError(
            f"the walk can end in any of {len(classes)} classes of nodes, so that it has no single stationary "
            "distribution"
        )
    s = int(classes[0][0])
    leaving = sp.csr_array(moves[[s]])
    if leaving.nnz == 0:
        return np.eye(n)[s]
    again = sp.block_array([[moves, sp.csr_array((n, 1))], [leaving, sp.csr_array((1, 1))]])
    visits = expected_visits(sp.csr_array(again), n, s)
    at_nodes = visits[:n]
    at_nodes[s] = visits[n]
    return at_nodes / at_nodes.sum()


def spectral_gap(weights: Weights) -> float:
    """Return the absolute spectral gap in 0..1: one minus the second largest eigenvalue modulus of P (section 12.2).

    The eigenvalues of P are those of its blocks of nodes that reach each other. In a block that is never left, they are
    those of D^(1/2) P D^(-1/2), with the stationary distribution on the diagonal of D. This matrix is symmetric if the
    walk is reversible (lemma 12.1). Eigenvalues computed from P itself can be far off by rounding, as in a corridor.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
    """
    moves = as_moves(weights)
    n = n_nodes(moves)
    if n == 1:
        return 1.0
    chances = _balanced(moves)
    if n <= MAX_DENSE_NODES:
        moduli = np.sort(np.abs(np.linalg.eigvals(chances.toarray())))
    else:
        start = np.random.default_rng(0).random(n)
        moduli = np.sort(np.abs(eigs(chances.T, k=2, which="LM", v0=start, return_eigenvectors=False)))
    return float(np.clip(1 - moduli[-2], 0.0, 1.0))


def mixing_time(weights: Weights, distance: float = 0.25) -> float:
    """Return the number of steps after which a walk from any node is close to stationary: t_mix (equation 4.30).

    This is the least t with max over s of |P^t(s, .) - pi|_TV <= distance; the left side never grows with t. ``inf`` if
    the walk is periodic, or not close after 2^60 steps. Powers of P are rounded, so a time of t steps has a relative
    error of a few times 10^-16 t: it is exact up to about 10^7 steps.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        distance: total variation distance that counts as close, between 0 and 1.
    """
    if not 0 < distance < 1:
        raise InputError(f"a mixing time needs a distance between 0 and 1, not {distance}")
    moves = as_moves(weights)
    if n_nodes(moves) > MAX_DENSE_NODES:
        raise InputError(f"the mixing time is computed for up to {MAX_DENSE_NODES} nodes, not {n_nodes(moves)}")
    stationary = stationary_distribution(moves)

    def is_far(power: NDArray[np.float64]) -> bool:
        return bool(np.abs(power - stationary).sum(axis=1).max() / 2 > distance)

    if not is_far(np.eye(len(stationary))):
        return 0.0
    powers = [with_staying(moves).toarray()]  # P^(2^i)
    while is_far(powers[-1]):
        if len(powers) > 60:
            return math.inf
        powers.append(powers[-1] @ powers[-1])
    steps, power = 0, np.eye(len(stationary))
    for i in range(len(powers) - 1, -1, -1):
        further = power @ powers[i]
        if is_far(further):
            steps, power = steps + (1 << i), further
    return float(steps + 1)


def commute_time(weights: Weights, source: int, target: int) -> float:
    """Return the mean number of steps from one node to another and back (section 10.3); ``inf`` if one may be missed.

    C(i, j) = H(i, j) + H(j, i), where H are the mean first-passage times.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        source: index of one node.
        target: index of the other node.
    """
    there, back = (mean_first_passage_time(weights, node) for node in (target, source))
    return float(there[as_node(source, len(there))] + back[target])


def committor(weights: Weights, sources: Targets, targets: Targets) -> NDArray[np.float64]:
    """Return the probability [n] to reach the targets before the sources.

    It is the harmonic function q(i) = sum_j P(i, j) q(j) with q = 0 on the sources and 1 on the targets (chapter 9).

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        sources: one or several nodes; the value is 0 there.
        targets: one or several other nodes; the value is 1 there.
    """
    moves = as_moves(weights)
    is_source, is_target = as_targets(sources, n_nodes(moves)), as_targets(targets, n_nodes(moves))
    if (is_source & is_target).any():
        raise InputError("sources and targets of a committor must differ, but a node is in both")
    keeps = sp.diags_array((~is_source).astype(float))  # a walk ends at a source
    return hitting_probability(sp.csr_array(keeps @ moves), np.flatnonzero(is_target))


def cover_time(weights: Weights, source: int) -> float:
    """Return the exact mean number of steps until every node was visited (chapter 11), up to `MAX_COVER_NODES` nodes.

    E(V, i) is the mean if the nodes V were visited and the walk is at i in V. E(V, i) = 1 + sum_j P_ij E(V + {j}, j) is
    a linear system for each V, solved for the larger sets first. ``inf`` if a node cannot be reached from every other.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        source: index of the start node.
    """
    moves = as_moves(weights)
    n = n_nodes(moves)
    source = as_node(source, n)
    if n > MAX_COVER_NODES:
        raise InputError(f"a cover time is exact for up to {MAX_COVER_NODES} nodes, not {n}; sample it instead")
    if not _is_irreducible(moves):
        return math.inf
    dense, places = moves.toarray(), np.arange(n)
    sets = np.arange(1 << n)
    sets = sets[sets >> source & 1 == 1]
    sizes = (sets[:, None] >> places & 1).sum(axis=1)
    means = np.zeros((1 << n, n))
    for size in range(n - 1, 0, -1):  # all sets of one size together
        visited = sets[sizes == size]
        is_inside = (visited[:, None] >> places & 1).astype(bool)
        inside = np.nonzero(is_inside)[1].reshape(-1, size)
        outside = np.nonzero(~is_inside)[1].reshape(-1, n - size)
        onward = means[visited[:, None] | 1 << outside, outside]
        leaving = dense[inside[:, :, None], outside[:, None, :]]
        known = 1 + (leaving @ onward[:, :, None])[:, :, 0]
        within = dense[inside[:, :, None], inside[:, None, :]]
        means[visited[:, None], inside] = _solve_several(within, leaving.sum(axis=2), known)
    return float(means[1 << source, source])


def sampled_cover_time(weights: Weights, source: int, n_walks: int = 1000, seed: int = 0) -> tuple[float, float]:
    """Estimate the mean number of steps until every node was visited, for graphs too large for `cover_time`.

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        source: index of the start node.
        n_walks: number of walks to draw, at least 2.
        seed: determines the walks.

    Returns:
        The mean and its standard error; (``inf``, 0) if a node cannot be reached from every other.
    """
    moves = as_moves(weights)
    source = as_node(source, n_nodes(moves))
    require_number("the number of walks for a cover time", n_walks, 2, is_whole=True)
    require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
    if not _is_irreducible(moves):
        return math.inf, 0.0
    rng = np.random.default_rng(seed)
    times = _sampled_cover_times(moves.indptr, moves.indices, moves.data, row_sums(moves), source, n_walks, rng)
    return float(times.mean()), float(times.std(ddof=1) / math.sqrt(n_walks))


def _solve_several(
    moves: NDArray[np.float64], leaving: NDArray[np.float64], b: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Solve (D - W) x = b for B small walks: x and b [B, n], W [B, n, n], ``leaving`` the rates [B, n] out of each."""
    moves, leaving, x, n = moves.copy(), leaving.copy(), b.copy(), b.shape[1]
    rates = np.empty_like(b)
    for k in range(n):
        after = slice(k + 1, n)
        rates[:, k] = leaving[:, k] + moves[:, k, after].sum(axis=1)
        shares = moves[:, after, k] / rates[:, [k]]
        moves[:, after, after] += shares[:, :, None] * moves[:, [k], after]
        leaving[:, after] += shares * leaving[:, [k]]
        x[:, after] += shares * x[:, [k]]
    for k in range(n - 1, -1, -1):
        x[:, k] = (x[:, k] + (moves[:, k, k + 1 :] * x[:, k + 1 :]).sum(axis=1)) / rates[:, k]
    return x


def _balanced(moves: sp.csr_array) -> sp.csr_array:
    """Return a matrix [n, n] with the eigenvalues of P; see `spectral_gap`."""
    roots = np.ones(n_nodes(moves))
    for nodes in closed_classes(moves):
        stationary = stationary_distribution(moves[nodes][:, nodes])
        roots[nodes] = np.sqrt(np.maximum(stationary, np.finfo(float).tiny))
    chances = with_staying(moves).tocoo()
    labels = connected_components(moves, directed=True, connection="strong")[1]
    kept = labels[chances.row] == labels[chances.col]
    rows, columns, values = chances.row[kept], chances.col[kept], chances.data[kept]
    return sp.csr_array((roots[rows] * values / roots[columns], (rows, columns)), shape=chances.shape)


def _is_irreducible(moves: sp.csr_array) -> bool:
    return connected_components(moves, directed=True, connection="strong")[0] == 1


@njit(cache=True)
def _sampled_cover_times(indptr, indices, data, totals, source, n_walks, rng):
    """Return the numbers of steps [n_walks] until all nodes were visited, for W as CSR with row sums ``totals`` > 0.

    Only moves are sampled. Each counts as the mean number of steps until the walk moves, which lowers the variance.
    """
    n = totals.shape[0]
    times = np.zeros(n_walks)
    visited = np.zeros(n, np.bool_)
    for walk in range(n_walks):
        visited[:] = False
        visited[source] = True
        missing, node = n - 1, source
        while missing > 0:
            times[walk] += 1 / totals[node]
            left = rng.random() * totals[node]
            edge = indptr[node]
            while left >= data[edge] and edge < indptr[node + 1] - 1:
                left -= data[edge]
                edge += 1
            node = indices[edge]
            if not visited[node]:
                visited[node] = True
                missing -= 1
    return times
