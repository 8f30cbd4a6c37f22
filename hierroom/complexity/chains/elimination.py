"""Elimination without subtraction: the factors of D - W, accurate however long the walk takes.

Gaussian elimination of D - W subtracts nearly equal numbers if a target is hard to reach. With a mean of 10^k steps
it loses k of the 16 digits of a float. Grassmann, Taksar and Heyman (Regenerative analysis and steady state
distributions for Markov chains, Operations Research 33, 1985) compute the diagonal as the rate at which a node is left.
Eliminating node k redirects its visitors,

    w_ij += w_ik w_kj / s_k,    r_i += w_ik r_k / s_k,    s_k = r_k + sum of w_kj over the j that are not eliminated,

where r is the rate from each node to nodes outside the system. Nothing is subtracted. So each factor, and each solution
for a nonnegative right-hand side, has a small relative error in each entry, even if D - W is ill-conditioned. The error
is at most about 2 n^2 roundings for n nodes, and in practice a few (O'Cinneide, Entrywise perturbation theory and error
analysis for Markov chains, Numerische Mathematik 65, 1993).
"""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import splu

from hierroom.support.errors import InputError
from hierroom.support.kernel import njit
from hierroom.support.output import said_when_slow

LEAST_RATE = 1e-290
"""Least rate at which a node may be left; with smaller ones, rates would underflow and means overflow."""
TOO_LONG = (
    f"a walk may take at most about {1 / LEAST_RATE:.0e} steps, as 64-bit floats hold no larger times; "
    "this one takes more"
)
SMALL = 500
"""Up to this number of equations, it takes less than a second."""


class Elimination:
    """The factors of D - W on nodes that a walk surely leaves: D - W = (I - F) (S - U).

    Args:
        moves: [n, n] CSR, the probability of each move among these nodes; its diagonal is ignored.
        leaving: [n], the probability to move from each node to one outside. From each node a path leads outside.
    """

    def __init__(self, moves: sp.csr_array, leaving: NDArray[np.float64]) -> None:
        self._order = _order(moves)
        ordered = sp.csr_array(moves[self._order][:, self._order])
        ordered.sort_indices()
        n, done = len(leaving), np.zeros(1, np.int64)
        # The last rows have most entries: of a dense matrix, the first i of n take a share of (i / n)^3.
        with said_when_slow(f"solving {n:,} equations", lambda: (done[0] / n) ** 3) if n > SMALL else nullcontext():
            *self._factors, self._rates = _eliminate(
                ordered.indptr.astype(np.int64),
                ordered.indices.astype(np.int64),
                ordered.data,
                leaving[self._order],
                done,
            )
        if not np.isfinite(self._rates).all() or self._rates.min(initial=1.0) < LEAST_RATE:
            raise InputError(TOO_LONG)

    def solve(self, b: ArrayLike) -> NDArray[np.float64]:
        """Solve (D - W) x = b; each entry of x is accurate if no entry of b [n] is negative."""
        return self._in_order(_solve, b)

    def solve_transposed(self, b: ArrayLike) -> NDArray[np.float64]:
        """Solve (D - W)' x = b, with the same accuracy."""
        return self._in_order(_solve_transposed, b)

    def _in_order(self, solver, b: ArrayLike) -> NDArray[np.float64]:
        solution = np.empty(len(self._order))
        solution[self._order] = solver(*self._factors, self._rates, np.asarray(b, float)[self._order])
        return solution


def _order(moves: sp.csr_array) -> NDArray[np.int64]:
    """Return an elimination order with little fill-in: SuperLU's COLAMD order of a regular matrix of this pattern."""
    pattern = sp.csr_array((np.ones(len(moves.data)), moves.indices, moves.indptr), shape=moves.shape)
    factors = splu((sp.diags_array(1.0 + np.diff(moves.indptr)) - pattern).tocsc())
    return np.argsort(factors.perm_c)


@njit(cache=True, nogil=True)
def _eliminate(starts, columns, weights, leaving, done):
    """Factor W [n, n], as CSR, and the rates [n] to nodes outside into F and U, as CSR, and S [n], row by row.

    ``done`` [1] is the number of rows so far.
    """
    n, n_lower, n_upper = len(leaving), 0, 0
    lower_starts, upper_starts = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    lower_columns, upper_columns = np.empty(2 * len(weights) + n, np.int64), np.empty(2 * len(weights) + n, np.int64)
    lower, upper = np.empty(len(lower_columns)), np.empty(len(upper_columns))
    row, is_there = np.zeros(n), np.zeros(n, np.bool_)
    after = np.empty(n, np.int64)  # the columns right of the diagonal in the current row
    leaving, rates = leaving.copy(), np.empty(n)
    for i in range(n):
        n_after, done[0] = 0, i
        for entry in range(starts[i], starts[i + 1]):
            j = columns[entry]
            if j == i:
                continue
            row[j], is_there[j] = weights[entry], True
            if j > i:
                after[n_after] = j
                n_after += 1
        n_lower = lower_starts[i]
        if n_lower + i > len(lower):
            lower_columns = np.concatenate((lower_columns, np.empty(len(lower) + n, np.int64)))
            lower = np.concatenate((lower, np.empty(len(lower) + n)))
        for k in range(i):  # new entries come further right
            if not is_there[k]:
                continue
            share = row[k] / rates[k]
            row[k], is_there[k] = 0.0, False
            lower_columns[n_lower], lower[n_lower] = k, share
            n_lower += 1
            leaving[i] += share * leaving[k]
            for entry in range(upper_starts[k], upper_starts[k + 1]):
                j = upper_columns[entry]
                if j == i:
                    continue  # a return to the node itself cancels, like staying
                row[j] += share * upper[entry]
                if not is_there[j]:
                    is_there[j] = True
                    if j > i:
                        after[n_after] = j
                        n_after += 1
        lower_starts[i + 1] = n_lower
        n_upper = upper_starts[i]
        if n_upper + n_after > len(upper):
            upper_columns = np.concatenate((upper_columns, np.empty(len(upper) + n, np.int64)))
            upper = np.concatenate((upper, np.empty(len(upper) + n)))
        rates[i] = leaving[i]
        for position in range(n_after):
            j = after[position]
            upper_columns[n_upper], upper[n_upper] = j, row[j]
            rates[i] += row[j]
            row[j], is_there[j] = 0.0, False
            n_upper += 1
        upper_starts[i + 1] = n_upper
    return (
        lower_starts, lower_columns[:n_lower].copy(), lower[:n_lower].copy(),
        upper_starts, upper_columns[:n_upper].copy(), upper[:n_upper].copy(), rates,
    )  # fmt: skip


@njit(cache=True)
def _solve(lower_starts, lower_columns, lower, upper_starts, upper_columns, upper, rates, b):
    """Solve (I - F) (S - U) x = b."""
    x = b.copy()
    for i in range(len(x)):
        for entry in range(lower_starts[i], lower_starts[i + 1]):
            x[i] += lower[entry] * x[lower_columns[entry]]
    for i in range(len(x) - 1, -1, -1):
        for entry in range(upper_starts[i], upper_starts[i + 1]):
            x[i] += upper[entry] * x[upper_columns[entry]]
        x[i] /= rates[i]
    return x


@njit(cache=True)
def _solve_transposed(lower_starts, lower_columns, lower, upper_starts, upper_columns, upper, rates, b):
    """Solve (S - U)' (I - F)' x = b."""
    x = b.copy()
    for i in range(len(x)):
        x[i] /= rates[i]
        for entry in range(upper_starts[i], upper_starts[i + 1]):
            x[upper_columns[entry]] += upper[entry] * x[i]
    for i in range(len(x) - 1, -1, -1):
        for entry in range(lower_starts[i], lower_starts[i + 1]):
            x[lower_columns[entry]] += lower[entry] * x[i]
    return x
