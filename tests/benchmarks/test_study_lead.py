"""Counts of the method that is ahead, on steps that are known."""

import numpy as np

from benchmarks.study.lead import Lead, leads
from benchmarks.study.paired import Paired

NEVER, NONE = np.inf, np.nan
FLAT = np.array([[40.0, 50, 60], [10, 20, NEVER], [NEVER, NEVER, NEVER], [5, 6, NONE], [7, 8, 9]])
HIERARCHICAL = np.array([[10.0, 20, 30], [15, 40, 50], [NEVER, NEVER, NEVER], [7, 8, NONE], [9, 9, 9]])
FOUND = Paired("steps_to_50", tuple("abcde"), (FLAT, HIERARCHICAL), (np.ones(5), np.ones(5)))


def test_counts_of_leads_by_hand():
    flat, hierarchical = leads(FOUND)
    # a: hierarchical, with every seed; b: flat, by its median of 20; c: neither; d: flat, with every seed; e: flat, and
    # its last seed is there with the other's
    assert flat == Lead(first=3, with_every_seed=1, reached=3, runs_reached=10, runs=14)
    assert hierarchical == Lead(first=1, with_every_seed=1, reached=4, runs_reached=11, runs=14)
