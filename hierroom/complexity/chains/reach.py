"""Reach curves: the probability to reach a node within t steps, and the expected number of nodes visited by then.

Let Q be the transition matrix among the nodes that are not targets, and h the probability to reach a target ever. Then

    P(T <= t) = h_s - (Q^t h)_s                                                                                 (1)

because Q^t h is the probability to reach the targets later than t.

Q is raised to the requested powers by repeated squaring, about 20 products for t = 10^6. Of large walks, a vector Q^t h
is stepped, unless squaring costs less.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chains.hitting import hitting_probability
from hierroom.complexity.chains.weights import (
    Targets,
    Weights,
    as_moves,
    as_node,
    as_targets,
    as_times,
    can_reach,
    n_nodes,
    with_staying,
)
from hierroom.support.errors import InputError
from hierroom.support.output import said_when_slow

SMALL = 96
"""Up to this number of nodes, squaring a dense matrix is faster than stepping with a sparse one."""
STEP_COST, DENSE_GAIN = 16_000, 32
"""Overhead of a step, in sparse multiplications; number of dense multiplications that cost as much as a sparse one."""
LONG = 10**9
"""More multiplications than this may take longer than a second."""
TINY = 1e-200
"""Smaller entries of a power are set to 0: they make no difference, and products of subnormal numbers are slow."""
MAX_DENSE_NODES = 10_000
"""With more nodes a dense matrix takes too much memory."""


def reach_probability(weights: Weights, source: int, targets: Targets, times: ArrayLike) -> NDArray[np.float64]:
    """Return the probability that a target is reached within t steps, in the shape of the times: equation (1).

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        source: index of the start node.
        targets: one or several nodes.
        times: numbers of steps t, any shape, each 0, 1, 2, ...

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.reach_probability(W, source=0, targets=2, times=[1, 2, 3]).round(3).tolist()
        [0.0, 0.25, 0.375]
    """
    moves, steps = as_moves(weights), as_times(times)
    n = n_nodes(moves)
    return _reached(moves, as_node(source, n), as_targets(targets, n)[:, None], steps.ravel())[0].reshape(steps.shape)


def expected_states(
    weights: Weights,
    source: int,
    times: ArrayLike,
    nodes: Iterable[int] | None = None,
    multiplicity: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Return the expected distinct nodes visited within t steps, the start included: sum over i of P(T_i <= t).

    Args:
        weights: W [n, n], dense or sparse; rows sum to at most one.
        source: index of the start node.
        times: numbers of steps t, any shape, each 0, 1, 2, ...
        nodes: the nodes that count; by default all of them.
        multiplicity: for each of ``nodes`` the number of nodes that it stands for, as in `augmented.alike_nodes`.

    Examples:
        >>> W = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
        >>> hierroom.complexity.expected_states(W, source=0, times=[0, 1, 2]).round(3).tolist()
        [1.0, 1.5, 2.0]
    """
    moves, steps = as_moves(weights), as_times(times)
    n = n_nodes(moves)
    counted = np.array([as_node(node, n) for node in (range(n) if nodes is None else nodes)], np.int64)
    weight = np.ones(len(counted)) if multiplicity is None else np.asarray(multiplicity, float)
    if weight.shape != counted.shape:
        raise InputError(f"multiplicity must have a number for each of {len(counted)} nodes, not shape {weight.shape}")
    targets = np.zeros((n, len(counted)), bool)
    targets[counted, np.arange(len(counted))] = True
    return (weight @ _reached(moves, as_node(source, n), targets, steps.ravel())).reshape(steps.shape)


def later_by_squaring(
    moves: sp.csr_array, source: int, targets: NDArray[np.bool_], hits: NDArray[np.float64], times: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the probability [m, k] to reach each set of targets [n, m] later than t steps, by squaring.

    ``hits`` [n, m] is the probability to reach each set ever, with 0 at the nodes of the set.
    """
    later = np.empty((targets.shape[1], len(times)))
    chances = with_staying(moves).toarray()
    n_bits, done = int(times.max(initial=0)).bit_length(), 0
    n_products = targets.shape[1] * n_bits
    with _saying(n_products * len(chances) ** 3 / DENSE_GAIN, lambda: done / n_products):
        for question, target in enumerate(targets.T):
            power = np.where(target[:, None], 0.0, chances)
            ahead = np.repeat(hits[:, [question]], len(times), axis=1)  # [n, k]
            for bit in range(n_bits):
                chosen = (times >> bit & 1).astype(bool)
                ahead[:, chosen] = power @ ahead[:, chosen]
                if bit + 1 < n_bits:
                    power = power @ power
                    power[power < TINY] = 0.0
                done += 1
            later[question] = ahead[source]
    return later


def later_by_stepping(
    moves: sp.csr_array, source: int, targets: NDArray[np.bool_], hits: NDArray[np.float64], times: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the same as `later_by_squaring`, computed step by step."""
    chances, killed, (different, at) = with_staying(moves), np.nonzero(targets), np.unique(times, return_inverse=True)
    ahead, now, last, later = hits.copy(), 0, int(times.max(initial=0)), np.empty((targets.shape[1], len(different)))
    with _saying(last * _step_cost(chances, targets), lambda: now / last):
        for n, wanted in enumerate(different):
            while now < wanted:
                ahead = chances @ ahead
                ahead[killed] = 0.0
                now += 1
            later[:, n] = ahead[source]
    return later[:, at]


def _step_cost(chances: sp.csr_array, targets: NDArray[np.bool_]) -> int:
    return (chances.nnz + len(targets)) * targets.shape[1] + STEP_COST


def _saying(multiplications: float, share: Callable[[], float]) -> AbstractContextManager[object]:
    """Show progress only if it may take long: a thread for each short curve would cost more than the curve."""
    return said_when_slow("computing a reach curve", share) if multiplications > LONG else nullcontext()


def _reached(
    moves: sp.csr_array, source: int, targets: NDArray[np.bool_], times: NDArray[np.int64]
) -> NDArray[np.float64]:
    is_seen = can_reach(moves.T.tocsr(), as_targets(source, n_nodes(moves)))
    moves, targets = moves[is_seen][:, is_seen], targets[is_seen]  # these nodes lead to no others
    source = int(is_seen[:source].sum())
    hits, done, n_questions = np.zeros(targets.shape), 0, targets.shape[1]
    with _saying(100 * n_questions * moves.nnz, lambda: done / n_questions):
        for target in targets.T:
            hits[:, done] = hitting_probability(moves, np.flatnonzero(target))
            done += 1
    n, last = n_nodes(moves), int(times.max(initial=0))
    squaring, stepping = n_questions * last.bit_length() * n**3 / DENSE_GAIN, last * _step_cost(moves, targets)
    is_dense = n <= SMALL or (n <= MAX_DENSE_NODES and squaring < stepping)
    method = later_by_squaring if is_dense else later_by_stepping
    later = method(moves, source, targets, np.where(targets, 0.0, hits), times)
    reached = np.clip(hits[source][:, None] - later, 0.0, 1.0)
    reached[targets[source]] = 1.0
    return reached
