"""A chain measured from trajectories of nodes, whatever environment they come from."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chain import Chain
from hierroom.complexity.exploration_graph import normalized
from hierroom.complexity.weights import as_times
from hierroom.errors import InputError


@dataclass(frozen=True, eq=False)
class PlayedChain:
    """The walk whose moves are as frequent as those of the trajectories, and the trajectories' own times beside it.

    W_ij is the fraction of the steps from node i that led to node j. An episode that ends without reaching the target
    leads from its last node back to the source, which takes one more step: this makes the chain's `expected_steps` and
    `observed_steps` the same number, whatever the policy. All else the chain predicts holds as far as the nodes are
    Markov states, which the observed numbers beside it tell.

    Args:
        chain: the chain; its goal ``"exit"`` is the target.
        times: [E] int64, number of steps of each episode until the target, or until it ended.
        reached: [E] bool, whether it reached the target.
    """

    chain: Chain
    times: NDArray[np.int64]
    reached: NDArray[np.bool_]

    @property
    def episodes(self) -> int:
        """Number of episodes E."""
        return len(self.times)

    @property
    def success_rate(self) -> float:
        """Fraction of the episodes that reached the target."""
        return float(self.reached.mean())

    @cached_property
    def observed_times(self) -> NDArray[np.int64]:
        """Steps from a start to the next visit of the target, over the episodes one after the other."""
        total = np.cumsum(self.times + ~self.reached)[self.reached]
        return np.diff(total, prepend=0)

    @property
    def observed_steps(self) -> float:
        """Mean number of steps from a start to the next visit of the target; ``inf`` if it was never visited.

        The steps after the last visit count too: it is the number of all steps, one more for each episode that missed
        the target, divided by the number of visits.
        """
        n_visits = int(self.reached.sum())
        return float((self.times + ~self.reached).sum() / n_visits) if n_visits else float("inf")

    @property
    def observed_std(self) -> float:
        """Standard deviation of `observed_times`; ``nan`` with fewer than two visits."""
        return float(self.observed_times.std(ddof=1)) if len(self.observed_times) > 1 else float("nan")

    def observed_reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Fraction of `observed_times` of at most t steps, which `Chain.reach_probability` predicts."""
        ends = np.sort(self.observed_times)
        return np.searchsorted(ends, as_times(t), side="right") / max(len(ends), 1)

    def __str__(self) -> str:
        half = int(np.median(self.observed_times)) if self.reached.any() else 1
        rows = [("expected steps", self.observed_steps, self.chain.expected_steps)]
        rows += [("standard deviation", self.observed_std, self.chain.std)]
        for t in (half, 2 * half, 4 * half):
            reach = float(self.chain.reach_probability(t))
            rows.append((f"target within {t}", float(self.observed_reach(t)), reach))
        nodes = len(self.chain.labels)
        lines = [f"{self.episodes} episodes over {nodes} nodes, {self.success_rate:.1%} reached the target"]
        lines += [f"  {'':<22}{'episodes':>12}{'their chain':>14}"]
        lines += [f"  {name:<22}{observed:>12.4g}{predicted:>14.4g}" for name, observed, predicted in rows]
        return "\n".join(lines)


def measure_trajectories(trajectories: Iterable[Sequence[Hashable]], target: Hashable) -> PlayedChain:
    """Measure the chain of one's own trajectories.

    Args:
        trajectories: for each episode its node at every step, that of the start first; all must begin at the same
            node. What follows the first visit of the target is left out.
        target: the node to reach, whose visit ends an episode.

    Returns:
        The chain and what was observed. Nodes are in the order in which they were first seen, the target last.

    Raises:
        InputError: if there is no trajectory, one has no step, they begin at several nodes or at the target, or two
            nodes have the same name.
    """
    numbers: dict[Hashable, int] = {}
    edges: list[NDArray[np.int64]] = []
    times, reached = [], []
    for trajectory in trajectories:
        nodes = list(trajectory)
        is_reached = target in nodes
        nodes = nodes[: nodes.index(target) + 1] if is_reached else nodes
        if len(nodes) < 2:
            raise InputError("a trajectory must have at least one step, from a node that is not the target")
        visited = np.array([numbers.setdefault(node, len(numbers)) for node in nodes])
        if visited[0] != 0:
            raise InputError(
                f"all trajectories must begin at the same node, not at {nodes[0]!r} and {next(iter(numbers))!r}; "
                "put one common node before them"
            )
        edges.append(np.stack([visited[:-1], visited[1:]]))
        if not is_reached:
            edges.append(np.array([[visited[-1]], [0]]))
        times.append(len(nodes) - 1)
        reached.append(is_reached)
    if not times:
        raise InputError("a chain is measured from at least one trajectory, but there is none")
    end = numbers.setdefault(target, len(numbers))
    n, (sources, targets) = len(numbers), np.concatenate(edges, axis=1)
    counts = sp.coo_array((np.ones(len(sources)), (sources, targets)), shape=(n, n)).tocsr()
    order = np.array([*np.delete(np.arange(n), end), end])
    names = list(numbers)
    chain = Chain.from_matrix(normalized(counts)[order][:, order], 0, n - 1, [names[i] for i in order])
    return PlayedChain(chain, np.array(times), np.array(reached))
