"""A test whether play is Markov on the nodes: does the next node depend on the one before the present one?

For each node j, the counts n_ijk of i, j, k one after the other are a table of predecessors i against successors k. If
play is a Markov chain of order one, rows and columns are independent. Pearson's statistic of the tables, summed over
the nodes j, is then chi-squared, with the sum of their degrees of freedom. (Anderson and Goodman, Statistical inference
about Markov chains, 1957, section 3.3; Billingsley, Statistical Inference for Markov Processes, 1961.) Staying counts
as a step. The test misses a memory of more than two steps that leaves no trace in two, and differences between levels.
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
    """Order one against order two."""

    statistic: float  # Pearson's chi-squared, summed over the nodes
    degrees: int  # degrees of freedom
    p_value: float  # probability of such a statistic, or a larger one, if play is Markov on the nodes

    @property
    def is_rejected(self) -> bool:
        """Return whether play is not Markov on these nodes, at the level `SIGNIFICANCE`."""
        return self.p_value < SIGNIFICANCE


def markov_test(triples: NDArray[np.int64]) -> MarkovTest | None:
    """Test order one by ``triples`` [T, 4], three nodes in a row and their count; None if the counts are too few."""
    from scipy.stats import chi2, chi2_contingency  # loads slowly, and few programs need it

    statistic, degrees = 0.0, 0
    for node in np.unique(triples[:, 1]):
        here = triples[triples[:, 1] == node]
        predecessors, rows = np.unique(here[:, 0], return_inverse=True)
        successors, columns = np.unique(here[:, 2], return_inverse=True)
        table = np.zeros((len(predecessors), len(successors)))
        table[rows, columns] = here[:, 3]
        table = _pooled(table)
        if min(table.shape) > 1:
            of_node = tuple(chi2_contingency(table, correction=False))  # statistic, p-value, degrees, expected
            statistic, degrees = statistic + float(of_node[0]), degrees + int(of_node[2])
    return MarkovTest(statistic, degrees, float(chi2.sf(statistic, degrees))) if degrees else None


def _pooled(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Merge the two smallest rows or columns, whichever are more, until no expected count is too small."""
    while min(table.shape) > 1:
        rows, columns = np.sort(table.sum(axis=1)), np.sort(table.sum(axis=0))
        if rows[0] * columns[0] >= LEAST_EXPECTED * rows.sum():
            break
        is_wide = table.shape[1] > table.shape[0]
        of_rows = table.T if is_wide else table
        order = np.argsort(of_rows.sum(axis=1), kind="stable")
        of_rows = np.vstack([of_rows[order[:2]].sum(axis=0), of_rows[order[2:]]])
        table = of_rows.T if is_wide else of_rows
    return table
