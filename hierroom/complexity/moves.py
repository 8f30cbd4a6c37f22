"""Moves between markings: the rules that apply and change something, and the counts that each changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import Rules


class Moves(NamedTuple):
    """E moves, each a rule that changes a marking, and the C changes of facts that they make, in the same order."""

    sources: NDArray[np.int64]  # [E], the index of the marking where each move begins
    rules: NDArray[np.int64]  # [E], the rule of each move
    starts: NDArray[np.int64]  # [E], the index of each move's first change
    of_move: NDArray[np.int64]  # [C], the move of each change
    facts: NDArray[np.int64]  # [C], the fact that each changes
    added: NDArray[np.integer]  # [C], how much the fact's count grows, or shrinks if negative


@dataclass(frozen=True, eq=False)
class MoveFinder:
    """Finds the moves of rules; for speed, it looks only at the facts that each rule changes."""

    rules: Rules

    @property
    def n_changes(self) -> int:
        """The number of changes of facts in all alternatives together."""
        return len(self._changes[1])

    def find(self, markings: NDArray[np.integer]) -> Moves:
        """Find all moves from markings [M, F]: each rule that applies and changes a marking."""
        n_changes, facts, counts = self._changes
        applies, ways = self.rules.choose(markings)
        sources, rules = np.nonzero(applies)
        used = rules * n_changes.shape[1] + ways[sources, rules]
        lengths = n_changes.ravel()[used]
        of_move = np.repeat(np.arange(len(used)), lengths)
        at = np.arange(len(of_move)) + np.repeat(
            (n_changes.ravel().cumsum() - n_changes.ravel())[used] - (lengths.cumsum() - lengths), lengths
        )
        before = markings[sources[of_move], facts[at]]
        added = np.minimum(before + counts[at], self.rules.limits[facts[at]]) - before
        kept = np.flatnonzero(added)
        moves, starts, of_move = np.unique(of_move[kept], return_index=True, return_inverse=True)
        return Moves(sources[moves], rules[moves], starts, of_move, facts[at[kept]], added[kept])

    @cached_property
    def _changes(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return how many facts each alternative changes [R, A], then each fact that changes [C] and its change [C]."""
        change = self.rules.given - self.rules.used
        return np.count_nonzero(change, axis=-1), np.nonzero(change)[-1], change[np.nonzero(change)]
