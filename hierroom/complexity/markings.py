"""The marking chain: rules unrolled over the counts of their facts, the counterpart of the augmented goal graph."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from hierroom.complexity.augmented import MAX_NODES
from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.chains.weights import as_targets, can_reach
from hierroom.complexity.requirements import relevant_rules
from hierroom.goals import Rules
from hierroom.support.errors import InputError
from hierroom.support.output import said_when_slow


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


MAX_COUNTS = 25_000_000
"""Most counts of facts in all rules, such as 5,000 rules over 5,000 facts; markings may have eight times as many."""
AT_ONCE = 1_000_000
"""Largest size of a batch: its markings times the alternatives of the rules, or times the changes of facts in them."""


class _Unrolled(NamedTuple):
    markings: NDArray[np.int64]  # [n - 1, F], all nodes but the target's
    edges: NDArray[np.int64]  # [E, 2]
    goals: NDArray[np.int64]  # [E], the goal that each edge achieves
    fewest: float  # edges from the start to the target, inf if there is no path


@dataclass(frozen=True, eq=False)
class MarkingGraph:
    """Rules unrolled over the counts of their facts, called markings, and the random walk on these markings.

    A marking has one outgoing edge for each rule that applies and changes it. All markings that have the target are one
    node, the last one; the start is the first node. Rules that do not matter for the target are left out.

    Args:
        rules: the rules.
        walk: the probabilities of one step.

    Examples:
        >>> rules = hierroom.Rules({"wood": {"gives": "wood"}, "raft": {"uses": "wood", "gives": "raft"}}, "raft")
        >>> marking_graph = hierroom.complexity.MarkingGraph(rules)
        >>> marking_graph.labels, marking_graph.fewest
        (('start', 'wood 1', 'raft'), 2)
    """

    rules: Rules
    walk: Walk = PAPER_WALK

    def __post_init__(self) -> None:
        if "exit" in self.rules.facts and self.rules.target != "exit":
            raise InputError(f"the fact 'exit' is not the target, {self.rules.target!r}; reports call the target exit")

    @cached_property
    def relevant(self) -> Rules | None:
        """The rules that matter, see `requirements.relevant_rules`; None if none gives the target."""
        return relevant_rules(self.rules)

    @property
    def goals(self) -> tuple[str, ...]:
        """The goals that matter for the target."""
        return self.relevant.names if self.relevant else ()

    @property
    def facts(self) -> tuple[str, ...]:
        """The F facts that a marking counts: those of the rules that matter."""
        return self.relevant.facts if self.relevant else (self.rules.target,)

    @property
    def markings(self) -> NDArray[np.int64]:
        """Counts of each fact at every node but the target's: [n - 1, F]."""
        return self._unrolled.markings

    @property
    def start(self) -> int:
        """Index of the start's node."""
        return 0

    @property
    def exit(self) -> int:
        """Index of the target's node."""
        return len(self.markings)

    @property
    def edges(self) -> NDArray[np.int64]:
        """The moves (from, to) between nodes without restarts: [E, 2]; two rules that do the same are two moves."""
        return self._unrolled.edges

    @property
    def edge_goals(self) -> NDArray[np.int64]:
        """The goal that each edge achieves, as an index into `goals`: [E]."""
        return self._unrolled.goals

    @property
    def fewest(self) -> float:
        """Fewest edges, each achieving a goal, from the start to the target; ``inf`` if it is out of reach."""
        return self._unrolled.fewest

    @cached_property
    def weights(self) -> sp.csr_array:
        """W [n, n] CSR: 0.19 divided evenly among a node's edges, and 0.01 for the restart, as for goal graphs."""
        return self.walk.weights(self.edges, self.exit + 1, self.start)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """A readable name of each node: ``"start"``, names such as ``"wood 2, table 1"``, and the target's name."""
        names = ["start"]
        for marking in self.markings[1:].tolist():
            counts = [f"{fact} {count}" for fact, count in zip(self.facts, marking, strict=True) if count]
            names.append(", ".join(counts) or "nothing")
        names.append(self.rules.target)
        if len({*names}) < len(names):  # facts may have names that look like counts of others
            names = [f"{name} #{node}" for node, name in enumerate(names)]
        return tuple(names)

    @cached_property
    def achieved(self) -> dict[str, tuple[int, ...]]:
        """The nodes at which each fact has a count above 0; ``"exit"`` stands for the target."""
        columns = zip(self.facts, self.markings.T, strict=True)
        nodes = {fact: tuple(np.flatnonzero(column).tolist()) for fact, column in columns}
        return nodes | {self.rules.target: (self.exit,), "exit": (self.exit,)}

    @cached_property
    def dead_ends(self) -> tuple[int, ...]:
        """The nodes from which the target cannot be reached without a restart."""
        n = self.exit + 1
        moves = sp.coo_array((np.ones(len(self.edges)), self.edges.T), shape=(n, n)).tocsr()
        return tuple(np.flatnonzero(~can_reach(moves, as_targets(self.exit, n))).tolist())

    @cached_property
    def _unrolled(self) -> _Unrolled:
        """Unroll breadth first: all markings at the same distance from the start together."""
        if self.relevant is None:
            return _Unrolled(np.zeros((1, 1), np.int64), np.zeros((0, 2), np.int64), np.zeros(0, np.int64), math.inf)
        rules, most = self.relevant, max(map(len, self.relevant.rules.values()))
        if (size := len(rules.names) * most * len(self.facts)) > MAX_COUNTS:
            counts = f"{len(rules.names):,} rules times {most} alternatives times {len(self.facts):,} facts"
            raise InputError(f"the rules are too many to unroll: {counts} are {size:,}, and at most {MAX_COUNTS:,} fit")
        target, multipliers = self.facts.index(self.rules.target), self._multipliers
        counts = rules.start_marking.astype(np.min_scalar_type(-int(rules.limits.max()) - 1))
        layers, edges, goals, fewest, distance = [counts[None]], [], [], math.inf, 0
        known = defaultdict(count().__next__)  # the node of each marking, by its code
        _ = known[int(layers[0][0] @ multipliers)]
        finder = MoveFinder(rules)
        at_once = max(1, AT_ONCE // max(finder.n_changes, rules.required[..., 0].size))
        with said_when_slow(lambda: f"unrolling {len(rules.names):,} rules, {len(known):,} markings so far"):
            while len(layers[-1]):
                first, distance, found = len(known) - len(layers[-1]), distance + 1, []
                for begin in range(0, len(layers[-1]), at_once):
                    batch = layers[-1][begin : begin + at_once]
                    moves = finder.find(batch)
                    self._refuse_many(batch, moves)
                    is_done = np.logical_or.reduceat((moves.facts == target) & (moves.added > 0), moves.starts)
                    after = np.add.reduceat(moves.added * multipliers[moves.facts], moves.starts)
                    after += (batch @ multipliers)[moves.sources]
                    codes, at, inverse = np.unique(after[~is_done], return_index=True, return_inverse=True)
                    n_before = len(known)
                    nodes = np.fromiter(map(known.__getitem__, codes.tolist()), np.int64, len(codes))
                    if len(known) >= self._most:
                        raise self._too_large()
                    found.append(_after(batch, moves, np.flatnonzero(~is_done)[at[nodes >= n_before]]))
                    ends = np.full(len(after), -1)
                    ends[~is_done] = nodes[inverse]
                    fewest = min(fewest, distance if is_done.any() else math.inf)
                    edges.append(np.stack([first + begin + moves.sources, ends], axis=1))
                    goals.append(moves.rules)
                layers.append(np.concatenate(found))
        pairs = np.concatenate(edges)
        pairs[pairs < 0] = len(known)
        return _Unrolled(np.concatenate(layers).astype(np.int64), pairs, np.concatenate(goals), fewest)

    @property
    def _multipliers(self) -> NDArray[np.int64]:
        """Return factors [F]; the code of a marking is the sum of its counts times these factors.

        Codes are unique if 63 bits suffice. Else the factors are random; then two of 10^5 markings have the same code
        with probability 10^-9.
        """
        sizes = [self.rules.capacity[fact] + 1 for fact in self.facts]
        if math.prod(sizes) < 2**63:
            return np.array([math.prod(sizes[:n]) for n in range(len(sizes))], np.int64)
        return np.random.default_rng(0).integers(1, 2**63, len(sizes))

    @cached_property
    def _adders(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return, for rules that only add to one fact, that fact [R] and the count added [R]; 0 for other rules.

        Such rules do not interfere with each other. So where some of them apply, all combinations of their facts can be
        reached. If several rules add to the same fact, only the first counts.
        """
        rules, known = self.relevant or self.rules, {self.rules.target}
        facts, given = rules.given[:, 0].argmax(axis=1), np.zeros(len(rules.names), np.int64)
        for n in np.flatnonzero((rules.n_alternatives == 1) & ~rules.used[:, 0].any(axis=1)):
            if np.count_nonzero(rules.given[n, 0]) == 1 and rules.facts[facts[n]] not in known:
                known.add(rules.facts[facts[n]])
                given[n] = rules.given[n, 0].max()
        return facts, given

    def _refuse_many(self, batch: NDArray[np.integer], moves: Moves) -> None:
        facts, given = (of_rules[moves.rules] for of_rules in self._adders)
        left = (self.relevant or self.rules).limits[facts] - batch[moves.sources, facts]
        steps = np.where(given > 0, left // np.maximum(given, 1), 0)
        if np.bincount(moves.sources, np.log1p(steps)).max(initial=0.0) > math.log(MAX_NODES):
            raise self._too_large()

    @property
    def _most(self) -> int:
        return min(MAX_NODES, 8 * MAX_COUNTS // len(self.facts))

    def _too_large(self) -> InputError:
        most = sorted(((self.rules.capacity[fact], fact) for fact in self.facts), reverse=True)
        high = [f"{fact} ({count:,})" for count, fact in most if count > 1][:5]
        lower = f"lower the capacity of {', '.join(high)}, or leave out" if high else "leave out"
        return InputError(
            f"the marking chain may have at most {self._most:,} markings, and these {len(self.goals)} rules over "
            f"{len(self.facts)} facts give more; {lower} rules that matter least"
        )


def _after(batch: NDArray[np.integer], moves: Moves, chosen: NDArray[np.int64]) -> NDArray[np.integer]:
    after = batch[moves.sources[chosen]]
    rows = np.full(len(moves.sources), -1)
    rows[chosen] = np.arange(len(chosen))
    rows = rows[moves.of_move]
    after[rows[rows >= 0], moves.facts[rows >= 0]] += moves.added[rows >= 0].astype(batch.dtype)
    return after
