"""A test whether play is Markov on the nodes: does the next node depend on the one before the present one?

For each node j, the counts n_ijk of i, j, k one after the other are a table of predecessors i against successors k. If
play is a Markov chain of order one, rows and columns are independent. Pearson's statistic of the tables, summed over
the nodes j, is then chi-squared, with the sum of their degrees of freedom (Anderson and Goodman, Statistical inference
about Markov chains, 1957, section 3.3; Billingsley, Statistical Inference for Markov Processes, 1961). Staying counts
as a step, so a node that is not left with the same probability at every step fails the test as well.

What it does not see: a memory of more than two steps that leaves no trace in two; and the level, if levels differ so
that each episode is a chain of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LEAST_EXPECTED = 5.0
"""Rows and columns with smaller expected counts are pooled (Cochran, 1954): the statistic is not chi-squared there."""
SIGNIFICANCE = 0.01
"""Below this p-value play is said not to be Markov."""


class MarkovTest(NamedTuple):
    """Order one against order two.

    Attributes:
        statistic: Pearson's chi-squared, summed over the nodes.
        degrees: degrees of freedom.
        p_value: probability of such a statistic, or a larger one, if play is Markov on the nodes.
    """

    statistic: float
    degrees: int
    p_value: float

    @property
    def is_rejected(self) -> bool:
        """Whether play is not Markov on these nodes, at the level `SIGNIFICANCE`."""
        return self.p_value < SIGNIFICANCE


def markov_test(triples: NDArray[np.int64]) -> MarkovTest | None:
    """Test order one against order two.

    Args:
        triples: [T, 4] int64, three nodes one after the other, and how often they came.

    Returns:
        The test; None if the counts are too few to compare any two predecessors of a node.
    """
    from scipy.stats import chi2, chi2_contingency  # loaded here because it takes its time, and few programs need it

    statistic, degrees = 0.0, 0
    for node in np.unique(triples[:, 1]):
        here = triples[triples[:, 1] == node]
        predecessors, rows = np.unique(here[:, 0], return_inverse=True)
        successors, columns = np.unique(here[:, 2], return_inverse=True)
        table = np.zeros((len(predecessors), len(successors)))
        table[rows, columns] = here[:, 3]
        table = _pooled(_pooled(table).T)
        if min(table.shape) > 1:
            of_node = tuple(chi2_contingency(table, correction=False))  # statistic, p-value, degrees, expected
            statistic, degrees = statistic + float(of_node[0]), degrees + int(of_node[2])
    return MarkovTest(statistic, degrees, float(chi2.sf(statistic, degrees))) if degrees else None


def _pooled(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """The table with its smallest rows made one, so that no expected count of it is too small."""
    rows = table[np.argsort(table.sum(axis=1))]
    columns = table.sum(axis=0)
    expected = rows.sum(axis=1) * columns.max(initial=0.0) / max(columns.sum(), 1.0)
    n_small = int((expected < LEAST_EXPECTED).sum())
    if not n_small:
        return rows
    if n_small < len(rows) and expected[:n_small].sum() < LEAST_EXPECTED:
        n_small += 1
    return np.vstack([rows[:n_small].sum(axis=0), rows[n_small:]])
