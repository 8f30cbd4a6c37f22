"""A test of whether play is Markov on the nodes: does the next node also depend on the previous one?

For each node j, the counts n_ijk of the sequences i, j, k form a table of predecessors i by successors k. If play is a
Markov chain of order one, rows and columns are independent. Pearson's statistic of the tables, summed over the nodes j,
is then chi-squared, with the sum of their degrees of freedom. (Anderson and Goodman, Statistical inference about Markov
chains, 1957, section 3.3; Billingsley, Statistical Inference for Markov Processes, 1961.) Staying counts as a step. The
test cannot find differences between levels, or a longer memory that does not show in the last two nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LEAST_EXPECTED = 5.0
"""Rows and columns with smaller expected counts are pooled (Cochran, 1954), else the statistic is not chi-squared."""
SIGNIFICANCE = 0.01
"""With a smaller p-value, play is reported as not Markov."""


class MarkovTest(NamedTuple):
    """The result of a test of order one against order two."""

    statistic: float  # Pearson's chi-squared, summed over the nodes
    degrees: int  # degrees of freedom
    p_value: float  # probability of a statistic at least as large if play is Markov on the nodes

    @property
    def is_rejected(self) -> bool:
        """Return whether play is not Markov on these nodes, at the level `SIGNIFICANCE`."""
        return self.p_value < SIGNIFICANCE


def markov_test(triples: NDArray[np.int64]) -> MarkovTest | None:
    """Test order one with ``triples`` [T, 4], three nodes in a row and their count; None if the counts are too few."""
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
    """Merge the two smallest rows, or columns if there are more of them, until no expected count is too small."""
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
