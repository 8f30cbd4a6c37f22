"""Any graph as the weights of a random walk: a networkx graph, or moves counted in trajectories."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from hierroom.complexity.chains.weights import as_weights, row_sums
from hierroom.support.errors import InputError

if TYPE_CHECKING:
    import networkx as nx


def graph_weights(graph: nx.Graph, weight: str | None = "weight", rates: bool = False) -> sp.csr_array:
    """Return W of the walk of `Chain.from_networkx`; an undirected edge leads both ways, and parallel edges add up."""
    import networkx as nx  # loaded here because it takes its time, and few programs need it

    if graph.number_of_nodes() == 0:
        raise InputError("an exploration graph needs at least one node")
    n_weighted = sum(weight in data for _, _, data in graph.edges(data=True)) if weight is not None else 0
    if 0 < n_weighted < graph.number_of_edges():
        raise InputError(
            f"either all edges of an exploration graph have the attribute {weight!r} or none: "
            f"{n_weighted} of {graph.number_of_edges()} have it"
        )
    try:
        attribute: Any = weight if n_weighted else None  # its stubs know of no None
        given = nx.to_scipy_sparse_array(graph, weight=attribute, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"the attribute {weight!r} of the edges must be a number: {error}") from error
    weights = as_weights(given)
    return normalized(weights) if rates or not n_weighted else weights


def normalized(weights: sp.csr_array) -> sp.csr_array:
    """Divide each row by its sum; an empty row, of a node that is never left, stays empty."""
    totals = row_sums(weights)
    return sp.csr_array(weights.multiply(1 / np.where(totals > 0, totals, 1.0)[:, None]))


def node_labels(nodes: Iterable[Hashable]) -> tuple[str, ...]:
    """Return the names of nodes as strings."""
    labels = tuple(map(str, nodes))
    if len(set(labels)) < len(labels):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise InputError(f"nodes need different names, but two of them are called {twice!r}")
    return labels


def node_index(nodes: Sequence[Hashable], node: Hashable) -> int:
    """Return the position of a node."""
    if node in nodes:
        return nodes.index(node)
    raise InputError(f"there is no node {node!r} among the {len(nodes)} nodes {first_names(nodes)}")


def first_names(nodes: Sequence[Hashable]) -> str:
    """Return the first names of many, for an error message."""
    return ", ".join(map(repr, nodes[:5])) + ", ..." * (len(nodes) > 5)
