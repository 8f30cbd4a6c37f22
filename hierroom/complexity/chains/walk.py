"""The random walk of the paper's appendix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from hierroom.complexity.chains.weights import SLACK
from hierroom.support.errors import InputError, require_number, use_python_numbers


@dataclass(frozen=True)
class Walk:
    """The probabilities of one step of the walk (paper, appendix A); they sum to one.

    Args:
        stay: probability that no transition happens.
        move: probability to follow an outgoing edge, divided evenly among a node's edges.
        restart: probability to return to the start node, from every node except the start, which stays instead.

    Examples:
        >>> lazy = hierroom.complexity.Walk(stay=0.9, move=0.09, restart=0.01)
        >>> round(hierroom.complexity.analyze("a", walk=lazy).expected_steps, 1)  # 28.0 with the paper's walk
        63.2
    """

    stay: float = 0.80
    move: float = 0.19
    restart: float = 0.01

    def __post_init__(self) -> None:
        chances = (self.stay, self.move, self.restart)
        for name, chance in zip(("stay", "move", "restart"), chances, strict=True):
            require_number(f"the probability {name} of a walk", chance, 0, 1)
        excess = sum(map(float, chances)) - 1
        if abs(excess) > SLACK:
            raise InputError(
                f"the probabilities stay, move, restart of a walk must sum to 1, not {1 + excess:g} "
                f"(off by {excess:.2g})"
            )
        use_python_numbers(self)

    def weights(
        self, edges: NDArray[np.integer], n: int, start: int, rates: NDArray[np.float64] | None = None
    ) -> sp.csr_array:
        """Return W [n, n] CSR of the walk on the nodes of a graph.

        Args:
            edges: [E, 2] from and to; edges between the same two nodes add up.
            n: number of nodes.
            start: the node to which the walk returns.
            rates: [E] relative probabilities of a node's edges; by default all its edges are equally likely.
        """
        sources, targets = edges.reshape(-1, 2).T
        rates = np.ones(len(sources)) if rates is None else rates
        out_rates = np.bincount(sources, rates, minlength=n)
        others = np.delete(np.arange(n), start)
        rows = np.concatenate([sources, others])
        columns = np.concatenate([targets, np.full(n - 1, start)])
        chances = np.concatenate([self.move * rates / out_rates[sources], np.full(n - 1, self.restart)])
        weights = sp.coo_array((chances, (rows, columns)), shape=(n, n)).tocsr()  # sums duplicate entries
        weights.eliminate_zeros()
        return weights


PAPER_WALK = Walk()
