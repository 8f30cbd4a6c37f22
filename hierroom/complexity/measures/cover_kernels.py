"""Random walks until every node was visited, as a compiled function."""

import numpy as np

from hierroom.support.compile.kernel import njit


@njit(cache=True, nogil=True)
def sampled_cover_times(indptr, indices, data, totals, source, n_walks, rng):
    """Walk until all nodes were visited, each step that moves counting for the mean number of steps that it takes.

    A walk stays at a node for a geometric number of steps; its mean instead of a draw leaves the mean of the cover time
    as it is, and its variance smaller.

    Args:
        indptr: CSR pointers of W without diagonal.
        indices: CSR columns.
        data: CSR weights.
        totals: [n] float64 row sums, all above 0.
        source: node where each walk begins.
        n_walks: number of walks.
        rng: generator.

    Returns:
        [n_walks] float64, in steps.
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
