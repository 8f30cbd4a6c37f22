"""W, the weights of a random walk: validation, W of graphs, and which nodes can reach which.

W[i, j] is the probability to move from node i to node j in one step. One minus the sum of a row is the probability to
stay, as in the paper. An entry on the diagonal adds to it. Staying cancels in the Laplacian.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.csgraph import connected_components, dijkstra

from hierroom.support.errors import InputError, shown

if TYPE_CHECKING:
    import networkx as nx

Weights: TypeAlias = ArrayLike | sp.sparray | sp.spmatrix
Targets: TypeAlias = int | Iterable[int]

EXACT, SLACK = 1e-9, 1e-6
"""Most by which rounding may lift a sum of probabilities above one: in 64-bit floats, and in coarser ones."""


def as_weights(weights: Weights) -> sp.csr_array:
    """Check W, where rows may have any sum, and return a copy as [n, n] float64 CSR without stored zeros."""
    try:
        given = sp.csr_array(weights) if sp.issparse(weights) else np.atleast_2d(np.asarray(weights))
        if given.dtype.kind == "c":
            raise TypeError("it holds complex numbers")
        matrix = sp.csr_array(given.astype(np.float64), copy=True)
    except (TypeError, ValueError, RuntimeError) as error:  # torch refuses tensors with a gradient
        raise InputError(f"W must be a square matrix of numbers: {error}") from error
    shape = matrix.shape or ()
    if len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
        raise InputError(f"W must be a square matrix with at least one node, not of shape {shape}")
    matrix.sum_duplicates()
    wrong = np.flatnonzero(~(np.isfinite(matrix.data) & (matrix.data >= 0)))
    if wrong.size:
        row = int(np.searchsorted(matrix.indptr, wrong[0], side="right")) - 1
        column, value = int(matrix.indices[wrong[0]]), matrix.data[wrong[0]]
        raise InputError(f"W must hold finite weights that are not negative, but W[{row}, {column}] is {value:g}")
    matrix.eliminate_zeros()
    return matrix


def as_probabilities(weights: Weights) -> sp.csr_array:
    """Check that the rows of W sum to at most one, and return it like `as_weights`.

    Rows of coarse floats, such as float32, may exceed one by rounding; they are then divided by their sum.
    """
    matrix = as_weights(weights)
    totals = row_sums(matrix)
    row = int(totals.argmax())
    if (excess := totals[row] - 1) > SLACK:
        raise InputError(
            f"the probabilities of a node's moves must sum to at most 1, but row {row} of W sums to {totals[row]:g} "
            f"({excess:.2g} too much); divide rates, counts or rounded numbers by their total first, as "
            "Chain.from_matrix does with rates=True"
        )
    return matrix if excess <= EXACT else sp.csr_array(sp.diags_array(1 / np.maximum(totals, 1.0)) @ matrix)


def as_moves(weights: Weights) -> sp.csr_array:
    """Check that the rows of W sum to at most one, and return it as [n, n] float64 CSR without its diagonal."""
    matrix = as_probabilities(weights)
    matrix.setdiag(0.0)
    matrix.eliminate_zeros()
    return matrix


def with_staying(moves: sp.csr_array) -> sp.csr_array:
    """Return P: the moves of `as_moves` with the probability to stay on the diagonal."""
    return sp.csr_array(moves + sp.diags_array(np.maximum(1 - row_sums(moves), 0.0)))


def n_nodes(matrix: sp.csr_array) -> int:
    """Return the number of rows."""
    return matrix.indptr.size - 1


def row_sums(matrix: sp.csr_array) -> NDArray[np.float64]:
    """Return D, the weighted out-degree of each node: [n]."""
    return np.asarray(matrix.sum(axis=1)).ravel()


def as_targets(targets: Targets, n: int) -> NDArray[np.bool_]:
    """Return the target nodes as a mask [n]; an empty set is a target that cannot be reached."""
    mask = np.zeros(n, bool)
    if isinstance(targets, np.ndarray):
        targets = np.atleast_1d(targets)
    for node in targets if isinstance(targets, Iterable) else (targets,):
        mask[as_node(node, n)] = True
    return mask


def as_node(node: int, n: int) -> int:
    """Check the index of a node."""
    if not isinstance(node, (int, np.integer)) or isinstance(node, bool) or not 0 <= node < n:
        raise InputError(f"a node must be a whole number from 0 to {n - 1}, not {shown(node)}")
    return int(node)


def as_nodes(nodes: Sequence[int], n: int) -> None:
    """Check the indices of nodes."""
    indices = np.asarray(nodes)
    if indices.ndim != 1:
        raise InputError(f"the nodes of a goal must be a list of whole numbers, not {shown(nodes)}")
    if indices.dtype.kind not in "iu" or not ((indices >= 0) & (indices < n)).all():
        for node in nodes:
            as_node(node, n)


def as_times(times: ArrayLike) -> NDArray[np.int64]:
    """Check numbers of steps and convert them to int64."""
    try:
        array = np.asarray(times)
    except ValueError:  # lists of different lengths
        array = np.array(None)
    if array.dtype.kind not in "iuf" or not ((array >= 0) & (array <= 2**62) & (array == np.floor(array))).all():
        raise InputError(f"numbers of steps must be whole numbers from 0 to 2**62, not {shown(times)}")
    return array.astype(np.int64)


def can_reach(
    weights: sp.csr_array, targets: NDArray[np.bool_], avoid: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Find the nodes [n] from which a path leads to a target and visits no node of ``avoid``; targets included."""
    if not targets.any():
        return targets
    if avoid is not None:
        weights = sp.csr_array(sp.diags_array(1.0 - avoid) @ weights)
        weights.eliminate_zeros()
    steps = dijkstra(weights.T, indices=np.flatnonzero(targets), unweighted=True, min_only=True)
    return np.isfinite(steps)


def closed_classes(weights: sp.csr_array) -> list[NDArray[np.int64]]:
    """Find the closed classes: sets of nodes that reach each other and no other node. A walk ends in one of them."""
    n_classes, labels = connected_components(weights, directed=True, connection="strong")
    edges = weights.tocoo()
    leaves = labels[edges.row] != labels[edges.col]
    is_closed = np.ones(n_classes, bool)
    is_closed[labels[edges.row[leaves]]] = False
    order = np.argsort(labels, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(labels, minlength=n_classes))[:-1])
    return [nodes for nodes, closed in zip(members, is_closed, strict=True) if closed]


def graph_weights(graph: nx.Graph) -> sp.csr_array:
    """Return the shares of each node's edges; an undirected edge leads both ways, and parallel edges add up."""
    import networkx as nx  # loads slowly, and few programs need it

    if not isinstance(graph, nx.Graph) or not len(graph):
        raise InputError(f"an exploration graph must be a networkx graph with nodes, not {shown(graph)}")
    n_weighted, n_edges = sum("weight" in data for _, _, data in graph.edges(data=True)), graph.number_of_edges()
    if 0 < n_weighted < n_edges:
        raise InputError(f"either all edges of a graph have a weight or none: {n_weighted} of {n_edges} have it")
    attribute: Any = "weight" if n_weighted else None  # networkx's stubs do not allow None
    try:
        return normalized(as_weights(nx.to_scipy_sparse_array(graph, weight=attribute)))
    except (TypeError, ValueError) as error:
        raise InputError(f"the weight of an edge must be a number: {error}") from error


def normalized(weights: sp.csr_array) -> sp.csr_array:
    """Divide each row by its sum; an empty row stays empty, and the walk never leaves its node."""
    exponents = np.frexp(weights.max(axis=1).toarray().ravel())[1]
    # powers of two, so that neither sums nor inverses overflow, and nothing is rounded
    scaled = sp.csr_array(weights.multiply(np.ldexp(1.0, -np.clip(exponents, -1000, 1000))[:, None]))
    totals = row_sums(scaled)
    return sp.csr_array(scaled.multiply(1 / np.where(totals > 0, totals, 1.0)[:, None]))


def node_labels(nodes: Iterable[Hashable]) -> tuple[str, ...]:
    """Return the names of nodes as strings."""
    try:
        labels = tuple(map(str, nodes))
    except (TypeError, ValueError) as error:  # no list, or a number of thousands of digits
        raise InputError(f"the names of nodes must be a list of short texts: {error}") from error
    if len(set(labels)) < len(labels):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise InputError(f"nodes need different names, but two of them are called {twice!r}")
    return labels


def node_index(nodes: Sequence[Hashable], node: Hashable) -> int:
    """Return the position of a node."""
    if node in nodes:
        return nodes.index(node)
    raise InputError(f"there is no node {shown(node)} among the {len(nodes)} nodes {first_names(nodes)}")


def first_names(nodes: Sequence[Hashable]) -> str:
    """Return the names of the first nodes, for an error message."""
    return ", ".join(map(shown, nodes[:5])) + ", ..." * (len(nodes) > 5)
