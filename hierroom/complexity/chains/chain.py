"""A random walk on named nodes and its passage times; both assumed and measured walks use it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.csgraph import connected_components

from hierroom.complexity.chains.hitting import first_passage_variance, mean_first_passage_time, passage_time_sensitivity
from hierroom.complexity.chains.laplacian import laplacian_hitting_time, laplacian_sensitivity
from hierroom.complexity.chains.reach import expected_states, reach_probability
from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.chains.weights import (
    Weights,
    as_node,
    as_nodes,
    as_probabilities,
    as_weights,
    graph_weights,
    n_nodes,
    node_index,
    node_labels,
    normalized,
)
from hierroom.support.errors import InputError, shown

if TYPE_CHECKING:
    import networkx as nx

EXIT = "exit"


class EdgeSensitivity(NamedTuple):
    """The effect of one edge on the time to the exit."""

    source: str  # label of the node where the edge begins
    target: str  # label of the node where it ends
    weight: float  # its weight in W
    steps_slope: float  # d expected_steps / d weight
    hitting_time_slope: float  # d hitting_time / d weight; nan if the hitting time is nan
    elasticity: float  # percent by which expected_steps changes if the weight grows by one percent


@dataclass(frozen=True, eq=False, repr=False)
class Chain:
    """A random walk on named nodes; each quantity is computed on first access.

    Args:
        weights: W [n, n] CSR, the probability of each move in one step; the rest of a row is the probability to stay.
        goals: for each goal the nodes at which it has been achieved; `"exit"` is one node.

    Examples:
        >>> chain = hierroom.complexity.Chain.from_matrix([[0, 1, 0], [0.5, 0, 0.5], [0, 0, 1]], source=0, target=2)
        >>> round(chain.expected_steps, 3), round(chain.reach_probability(2).item(), 3)
        (4.0, 0.5)
    """

    weights: sp.csr_array
    labels: tuple[str, ...]
    source: int
    goals: Mapping[str, tuple[int, ...]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", as_probabilities(self.weights))
        n = n_nodes(self.weights)
        if len(self.labels) != n:
            raise InputError(f"a chain of {n} nodes needs {n} labels, not {len(self.labels)}")
        node_labels(self.labels)  # refuses a label given twice
        if EXIT not in self.goals:
            raise InputError(f"a chain needs a goal {EXIT!r}; there is {', '.join(map(repr, self.goals)) or 'none'}")
        as_node(self.source, n)
        for nodes in self.goals.values():
            as_nodes(nodes, n)
        if len(self.goals[EXIT]) != 1:
            raise InputError(f"the goal {EXIT!r} of a chain must be one node, not {len(self.goals[EXIT])}")
        if self.source in self.goals[EXIT]:
            raise InputError(f"a chain's start and exit must be two nodes, but both are {self.labels[self.source]!r}")

    @classmethod
    def from_matrix(
        cls,
        matrix: Weights,
        source: int | str,
        target: int | str,
        labels: Sequence[Hashable] | None = None,
        *,
        rates: bool = False,
    ) -> Chain:
        """Return the walk of a matrix of probabilities or rates, for any exploration graph.

        Args:
            matrix: [n, n] dense or sparse; one minus a row's sum is the node's probability to stay.
            source: the start node, by its index or its label.
            target: the goal ``"exit"``, by its index or its label.
            labels: [n] names of the nodes; their indices by default.
            rates: divide each row by its sum, for rates or counts.
        """
        weights = normalized(as_weights(matrix)) if rates else as_probabilities(matrix)
        n = n_nodes(weights)
        names = node_labels(range(n) if labels is None else labels)
        start, end = (node_index(names, one) if isinstance(one, str) else as_node(one, n) for one in (source, target))
        return cls(weights, names, start, {EXIT: (end,)})

    @classmethod
    def from_networkx(cls, graph: nx.Graph, source: Hashable, target: Hashable, walk: Walk = PAPER_WALK) -> Chain:
        """Return the paper's walk on a networkx graph, directed or not; the names of its nodes become labels.

        It moves along a node's edges in proportion to their ``weight``, or evenly if no edge has one, and returns to
        the source from every other node. From the target it can only return to the source. Edges from a node to itself
        do not count. Other walks: `from_matrix` takes ``nx.to_numpy_array(graph)``.
        """
        weights, nodes = graph_weights(graph).tocoo(), list(graph)
        first, last = node_index(nodes, source), node_index(nodes, target)
        counts = (weights.row != weights.col) & (weights.row != last)
        edges, shares = np.stack([weights.row, weights.col], axis=1)[counts], np.asarray(weights.data, float)[counts]
        return cls.from_matrix(walk.weights(edges, len(nodes), first, shares), first, last, nodes)

    @cached_property
    def hitting_time(self) -> float:
        """The paper's hitting time of the exit, b' pinv(D - W) b. It does not count steps: see `chains.laplacian`."""
        return self.hitting_time_to(EXIT)

    @cached_property
    def expected_steps(self) -> float:
        """Mean first-passage time to the exit in steps, including steps that stay."""
        return self.expected_steps_to(EXIT)

    @cached_property
    def variance(self) -> float:
        """Variance of the first-passage time to the exit, in steps squared."""
        return float(first_passage_variance(self.weights, self.goals[EXIT])[self.source])

    @cached_property
    def std(self) -> float:
        """Standard deviation of the first-passage time to the exit, in steps."""
        return self.variance**0.5

    def expected_steps_to(self, goal: str) -> float:
        """Return the mean steps to a goal such as `"key 1"` or `"exit"`, or to a node; ``inf`` if it may be missed."""
        return float(mean_first_passage_time(self.weights, self.nodes_of(goal))[self.source])

    def hitting_time_to(self, node: str) -> float:
        """Return the paper's hitting time of a single node, given its label; ``nan`` if `is_one_way` is true.

        In that case the formula gives only the number of steps spent at the start, which does not measure difficulty.
        """
        nodes = self.nodes_of(node)
        if len(nodes) != 1:
            raise InputError(
                f"the Laplacian hitting time needs a single node, but {shown(node)} is achieved at {len(nodes)}; "
                "name one of them, such as 'key 1, all closed' or 'room 1, open 1', or ask for the expected steps"
            )
        value = laplacian_hitting_time(self.weights, self.source, nodes[0])
        return np.nan if np.isfinite(value) and self.is_one_way() else value

    def is_one_way(self) -> bool:
        """Return whether the walk may reach a node from which it never returns to the start, such as a final exit."""
        _, classes = connected_components(self.weights, connection="strong")
        is_ours = classes == classes[self.source]
        return self.weights[is_ours][:, ~is_ours].nnz > 0

    def reach_probability(self, t: ArrayLike, goal: str = EXIT) -> NDArray[np.float64]:
        """Return the probability, in the shape of t, that a goal is achieved within t steps, each 0, 1, 2, ..."""
        return reach_probability(self.weights, self.source, self.nodes_of(goal), t)

    def expected_states(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the expected number of distinct nodes visited within t steps, start included, in the shape of t."""
        return expected_states(self.weights, self.source, t)

    def edge_sensitivity(self) -> list[EdgeSensitivity]:
        """Return the effect of each edge on the time to the exit, most helpful first; empty if the time is ``inf``."""
        if np.isinf(self.expected_steps):
            return []
        exit_node = self.goals[EXIT][0]
        steps = passage_time_sensitivity(self.weights, self.source, exit_node).tocoo()
        paper = laplacian_sensitivity(self.weights, self.source, exit_node)
        unknown, at = np.nan if self.is_one_way() else 0.0, (steps.row, steps.col)
        weights, of_paper = (np.asarray(matrix[at]).ravel() for matrix in (self.weights, paper))
        numbers = weights, steps.data, of_paper + unknown, weights * steps.data / self.expected_steps
        names = ([self.labels[node] for node in nodes.tolist()] for nodes in at)
        edges = map(EdgeSensitivity, *names, *(column.tolist() for column in numbers))
        return sorted(edges, key=lambda edge: edge.elasticity)

    def goal_sensitivity(self) -> dict[str, float]:
        """Return the percent change of expected_steps if a goal gets one percent easier, the bottleneck first.

        Sum the elasticities of the edges by which the goal is achieved. Empty if expected_steps is ``inf``.
        """
        if np.isinf(self.expected_steps):
            return {}
        slopes = passage_time_sensitivity(self.weights, self.source, self.goals[EXIT])
        elasticity = slopes.multiply(self.weights).tocoo()
        by_goal = {}
        for goal, nodes in self.goals.items():
            achieved = np.zeros(len(self.labels), bool)
            achieved[list(nodes)] = True
            achieves = ~achieved[elasticity.row] & achieved[elasticity.col]
            by_goal[goal] = float(elasticity.data[achieves].sum() / self.expected_steps)
        return dict(sorted(by_goal.items(), key=lambda item: item[1]))

    def __repr__(self) -> str:
        first, last = (self.labels[node] for node in (self.source, self.goals[EXIT][0]))
        return f"<Chain: random walk on {len(self.labels)} nodes from {first} to {last}>"

    def nodes_of(self, goal: str) -> tuple[int, ...]:
        """Return the nodes at which a goal has been achieved, or the single node with that label."""
        if isinstance(goal, str) and goal in self.goals:
            return tuple(self.goals[goal])
        if isinstance(goal, str) and goal in self.labels:
            return (self.labels.index(goal),)
        raise InputError(
            f"the goals are {', '.join(self.goals)}, and nodes are called "
            f"{', '.join(map(repr, self.labels[:2]))}, ...; there is no {shown(goal)}"
        )
