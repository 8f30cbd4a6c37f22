"""Reach curves: the probability to reach a node within t steps, and the expected number of nodes visited by then.

Let Q be the transition matrix among the nodes that are not targets, and h the probability to reach a target ever. Then

    P(T <= t) = h_s - (Q^t h)_s                                                                                 (1)

because Q^t h is the probability to reach the targets later than t.

- **Small walks**: Q is raised to the requested powers by repeated squaring, about 20 products for t = 10^6.
- **Large walks**: a vector w_t = Q^t h is stepped until its decay is geometric. If lo <= 1 - w_{t+1} / w_t <= hi at
every node, then (1 - hi)^k w_t <= w_{t+k} <= (1 - lo)^k w_t for all k. These are the Collatz-Wielandt bounds, as Q has
no negative entries. Once they differ by less than the tolerance for every k, the rest of the curve is known.
  If a walk mixes slowly, Q is squared once stepping has cost as much as squaring, if more steps than that are left.
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

TOLERANCE = 1e-12
"""Largest error of a probability due to the geometric tail; rounding may add more for very slow walks."""
SMALL = 96
"""Up to this number of nodes, squaring a dense matrix is faster than stepping with a sparse one."""
CHECK_EVERY = 64
"""Number of steps after which the code checks again whether the decay is geometric."""
PATIENCE = 16_384
"""Least number of steps without a geometric decay before squaring replaces stepping."""
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
    """Return the same as `later_by_squaring`, computed step by step until the decay is geometric."""
    later = np.empty((targets.shape[1], len(times)))
    order = np.argsort(times, kind="stable")
    chances, killed = with_staying(moves), np.nonzero(targets)
    ahead, now, filled = hits.copy(), 0, 0
    last, (n, n_questions) = int(times.max(initial=0)), targets.shape
    step_cost = (chances.nnz + n) * n_questions + STEP_COST
    steps_of_squaring = n_questions * last.bit_length() * n**3 / DENSE_GAIN / step_cost
    patience = max(PATIENCE, int(steps_of_squaring))
    with _saying(last * step_cost, lambda: now / last):
        while filled < len(times):
            while filled < len(times) and times[order[filled]] == now:
                later[:, order[filled]] = ahead[source]
                filled += 1
            if now == last:
                break
            following = chances @ ahead
            following[killed] = 0.0
            if now % CHECK_EVERY == 0:
                rest, second = order[filled:], chances @ following
                second[killed] = 0.0
                tail = _geometric_tail([ahead, following, second], source, times[rest] - now)
                if tail is not None:
                    later[:, rest] = tail
                    break
            if now == patience and last - now > steps_of_squaring and n <= MAX_DENSE_NODES:
                rest = order[filled:]
                later[:, rest] = later_by_squaring(moves, source, targets, ahead, times[rest] - now)
                break
            ahead, now = following, now + 1
    return later


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
    method = later_by_squaring if n_nodes(moves) <= SMALL else later_by_stepping
    later = method(moves, source, targets, np.where(targets, 0.0, hits), times)
    reached = np.clip(hits[source][:, None] - later, 0.0, 1.0)
    reached[targets[source]] = 1.0
    return reached


def _geometric_tail(
    waves: list[NDArray[np.float64]], source: int, times: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Return w_t at the source [m, k] for ``times`` if the decay over one or two steps determines it; else None.

    ``waves`` are w_0, w_1, w_2. Two steps are for walks that alternate between two halves of the nodes, as on a grid.
    """
    for stride in (1, 2):
        cycles, phases = np.divmod(times, stride)
        hazard = _geometric_hazard(waves[0], waves[stride], source, int(cycles.max()))
        if hazard is not None:
            first = np.stack([wave[source] for wave in waves[:stride]], axis=1)  # [m, stride]
            return first[:, phases] * np.exp(np.log1p(-hazard)[:, None] * cycles)
    return None


def _geometric_hazard(
    ahead: NDArray[np.float64], following: NDArray[np.float64], source: int, remaining: int
) -> NDArray[np.float64] | None:
    """Return 1 - w_{t+1} / w_t at the source [m] if the bounds over all nodes determine the rest of each curve."""
    counts = ahead > 0
    ratio = np.divide(ahead - following, ahead, out=np.zeros_like(ahead), where=counts)
    low = np.clip(np.where(counts, ratio, np.inf).min(axis=0), 0.0, 1.0)
    high = np.clip(np.where(counts, ratio, -np.inf).max(axis=0), 0.0, 1.0)
    # the two bounds differ by at most k (1 - low)^(k - 1) (high - low), which peaks near k = 1 / low
    longest = np.minimum(remaining, 1 / np.maximum(low, 1 / max(remaining, 1)))
    gap = ahead[source] * np.maximum(high - low, 0.0)
    error = np.minimum(ahead[source], longest * gap)
    is_rounding = gap <= 8 * np.finfo(float).eps  # no further step would tighten the bounds
    if not (is_rounding | (error <= TOLERANCE)).all():
        return None
    return np.clip(ratio[source], 0.0, 1 - np.finfo(float).eps)
