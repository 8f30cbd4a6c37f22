"""Dependencies of any kind: rules that need, use and give counts of facts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.goals.alternatives import (
    Alternative,
    first_names,
    plain_alternative,
    read_alternatives,
    read_counts,
    read_name,
    toml_key,
    toml_text,
)
from hierroom.support.arrays import freeze
from hierroom.support.errors import InputError, shown
from hierroom.support.files import as_utf8, read_toml, write_atomically


@dataclass(frozen=True)
class Rules:
    """Rules by the names of their goals: the facts that each needs, uses (takes away) and gives.

    A rule applies by the first of its alternatives that has all required facts. If an alternative both needs and uses a
    fact, the larger count is required. It takes what it uses, then adds what it gives. Counts beyond a fact's capacity
    are lost.

    A marking has a count of each fact. Arrays over rules, alternatives and facts are [R, A, F].

    Args:
        rules: for each goal one alternative or a list of them, each with any of ``needs``, ``uses`` and ``gives``: a
            fact, a list of facts, or a mapping from facts to counts.
        target: the fact to reach once; or a goal, which then gives a fact of its name, too.
        capacity: largest counts of facts; 1 by default.
        start: counts of facts at the start; 0 by default.
        label: the name of the rules in every output. Equality ignores it.

    Examples:
        >>> raft = [{"uses": {"wood": 3}, "gives": "raft"}, {"needs": "rope", "uses": "wood", "gives": "raft"}]
        >>> rules = hierroom.Rules({"wood": {"gives": "wood"}, "raft": raft}, target="raft", capacity={"wood": 3})
        >>> rules.facts, hierroom.complexity.analyze(rules).fewest  # three times wood, then the raft
        (('wood', 'raft', 'rope'), 4)
        >>> rules.apply("wood", [2, 0, 0]).tolist(), rules.apply("raft", [2, 0, 0])
        ([3, 0, 0], None)
        >>> after, applies = rules.apply_all([3, 0, 0])
        >>> applies.tolist()
        [True, True]
        >>> applies, alternatives = rules.choose([1, 0, 1])  # one wood and a rope: the second way to a raft
        >>> applies.tolist(), alternatives.tolist()
        ([True, True], [0, 1])
        >>> rules == hierroom.Rules.from_dict(rules.to_dict())
        True
        >>> print(rules.to_toml("raft.toml").splitlines()[0])
        target = "raft"
        >>> hierroom.Rules.from_toml("raft.toml").name
        'raft'
    """

    rules: Mapping[str, Any]
    target: str
    capacity: Mapping[str, int] = field(default_factory=dict)
    start: Mapping[str, int] = field(default_factory=dict)
    label: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.rules, Mapping):
            raise InputError(f"rules must be a mapping from goals to what each needs, not {shown(self.rules)}")
        if not self.rules:
            raise InputError("rules must have at least one goal; there is none")
        rules = {
            read_name("the name of a rule", name): read_alternatives(name, rule) for name, rule in self.rules.items()
        }
        if isinstance(goal := self.target, str) and goal in rules and goal not in _facts_of(rules):
            rules[goal] = tuple(way._replace(gives={**way.gives, goal: 1}) for way in rules[goal])
        facts = _facts_of(rules)
        object.__setattr__(self, "rules", rules)
        capacity = read_counts("the capacity", self.capacity, low=1)
        start = read_counts("the start", self.start, low=0)
        for what, entries in (("the target", (self.target,)), ("the capacity", capacity), ("the start", start)):
            for fact in entries:
                if not isinstance(fact, str) or fact not in facts:
                    raise InputError(f"{what} must name facts of the rules ({first_names(facts)}), not {shown(fact)}")
        object.__setattr__(self, "capacity", {fact: capacity.get(fact, 1) for fact in facts})
        object.__setattr__(self, "start", {fact: start.get(fact, 0) for fact in facts})
        for fact, count in self.start.items():
            if count > self.capacity[fact]:
                raise InputError(
                    f"the start has {count} of {fact!r}, but its capacity is {self.capacity[fact]}; raise the capacity"
                )
        if self.start[self.target]:
            raise InputError(f"the target {self.target!r} must not be there at the start")
        if self.label is not None:
            read_name("the name of rules", self.label)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the cached arrays, because they would be writable in a copy."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def __eq__(self, other: object) -> bool:
        """Compare also the order of goals and facts, which numbers them."""
        return isinstance(other, Rules) and self._ordered == other._ordered

    def __hash__(self) -> int:
        return hash((self.names, self.facts, self.target))

    @property
    def _ordered(self) -> tuple[Any, ...]:
        return self.target, *([*table.items()] for table in (self.rules, self.capacity, self.start))

    @property
    def name(self) -> str:
        """The label, or ``rules``."""
        return self.label or "rules"

    @property
    def names(self) -> tuple[str, ...]:
        """The goals: the names of the R rules."""
        return tuple(self.rules)

    @property
    def facts(self) -> tuple[str, ...]:
        """The F facts, in the order in which the rules first name them."""
        return tuple(self.capacity)

    @cached_property
    def required(self) -> NDArray[np.int64]:
        """Counts that each alternative needs or uses [R, A, F]; rules with fewer than A repeat their last one."""
        return self._array("needs", "uses")

    @cached_property
    def used(self) -> NDArray[np.int64]:
        """Counts that each alternative takes away [R, A, F]."""
        return self._array("uses")

    @cached_property
    def given(self) -> NDArray[np.int64]:
        """Counts that each alternative gives [R, A, F]."""
        return self._array("gives")

    @cached_property
    def n_alternatives(self) -> NDArray[np.int64]:
        """Number of alternatives of each rule [R]."""
        return freeze(np.array([len(ways) for ways in self.rules.values()]))

    @cached_property
    def limits(self) -> NDArray[np.int64]:
        """The capacity of each fact [F]."""
        return freeze(np.array([*self.capacity.values()]))

    @property
    def start_marking(self) -> NDArray[np.int64]:
        """The marking at the start [F]."""
        return np.array([*self.start.values()])

    def apply_all(self, markings: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Apply each rule to markings [..., F]; a rule that does not apply leaves a marking unchanged.

        Returns:
            the markings after each rule [..., R, F], and whether it applies [..., R].
        """
        applies, ways = self.choose(np.asarray(markings))
        before, rules = np.asarray(markings)[..., None, :], np.arange(len(self.rules))
        after = np.minimum(before - self.used[rules, ways] + self.given[rules, ways], self.limits)
        return np.where(applies[..., None], after, before), applies

    @cached_property
    def _thresholds(self) -> tuple[NDArray[np.int64], NDArray[np.int64], list[tuple[Any, NDArray[np.uint64]]]]:
        """Return T thresholds: facts and counts. For each 64 of them, return which alternatives require which, as bits.

        The alternatives are given by number, or as a slice of all of them if many require one. T is a multiple of 64;
        the thresholds that fill it up are always met.
        """
        entries = np.nonzero(self.required)
        asked, inverse = np.unique(np.stack([entries[2], self.required[entries]], axis=1), axis=0, return_inverse=True)
        asked = np.concatenate([asked, np.zeros((64 - len(asked) % 64, 2), np.int64)])
        asks = np.zeros((*self.required.shape[:2], len(asked)), bool)
        asks[entries[0], entries[1], inverse.ravel()] = True
        words = _bits(asks).reshape(-1, len(asked) // 64).T
        askers = [slice(None) if np.count_nonzero(word) > word.size / 4 else np.flatnonzero(word) for word in words]
        return asked[:, 0], asked[:, 1], [(asker, word[asker]) for asker, word in zip(askers, words, strict=True)]

    def choose(self, markings: ArrayLike) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Return whether each rule applies to markings [..., F], and by which of its alternatives; both [..., R]."""
        if np.shape(markings)[-1:] != (len(self.facts),):
            raise InputError(f"markings must have {len(self.facts)} counts, one a fact, not shape {np.shape(markings)}")
        facts, counts, asks = self._thresholds
        lacks = _bits(np.take(markings, facts, axis=-1) < counts)
        most = self.required.shape[1]
        enough = np.ones((*lacks.shape[:-1], len(self.rules) * most), bool)
        for word, (askers, asked) in enumerate(asks):
            enough[..., askers] &= (lacks[..., word, None] & asked) == 0
        if most == 1:
            return enough, np.broadcast_to(np.int64(0), enough.shape)
        enough = enough.reshape(*lacks.shape[:-1], len(self.rules), most)
        return np.any(enough, axis=-1), enough.argmax(axis=-1)

    def apply(self, goal: str, marking: ArrayLike) -> NDArray[np.int64] | None:
        """Return the marking [F] after the rule of a goal, or None if the rule does not apply."""
        if goal not in self.names:
            raise InputError(f"the rules are {first_names(self.rules)}; there is no {shown(goal)}")
        counts = np.asarray(marking)
        is_marking = counts.shape == (len(self.facts),) and counts.dtype.kind in "iu"
        if not (is_marking and ((counts >= 0) & (counts <= self.limits)).all()):
            raise InputError(
                f"a marking must be {len(self.facts)} whole numbers, one a fact, from 0 to its capacity, "
                f"not {shown(marking)}"
            )
        after, applies = self.apply_all(counts)
        rule = self.names.index(goal)
        return after[rule] if applies[rule] else None

    def to_dict(self) -> dict[str, Any]:
        """Return the rules as plain types, as `from_dict` takes them."""
        rules = {name: [plain_alternative(way) for way in ways] for name, ways in self.rules.items()}
        return {
            **({} if self.label is None else {"name": self.label}),
            "target": self.target,
            "capacity": {fact: count for fact, count in self.capacity.items() if count != 1},
            "start": {fact: count for fact, count in self.start.items() if count},
            "rules": {name: ways[0] if len(ways) == 1 else ways for name, ways in rules.items()},
        }

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Rules:
        """Return the rules of a table with ``rules``, ``target`` and optional ``capacity``, ``start`` and ``name``."""
        if not isinstance(table, Mapping):
            raise InputError(f"rules must be given as a table, not {shown(table)}")
        if not {"rules", "target"} <= {*table} <= {"rules", "target", "capacity", "start", "name"}:
            raise InputError(
                "rules must hold tables of rules and a target, perhaps capacity, start and name, and nothing else; "
                f"they hold {', '.join(sorted(map(str, table))) or 'nothing'}"
            )
        return cls(
            table["rules"], table["target"], table.get("capacity", {}), table.get("start", {}), table.get("name")
        )

    def to_toml(self, path: str | Path | None = None) -> str:
        """Return the rules as TOML text, and write it to ``path`` if one is given."""
        table = self.to_dict()
        lines = [f"{entry} = {toml_text(table[entry])}" for entry in ("name", "target") if entry in table]
        lines += [f"{entry} = {toml_text(table[entry])}" for entry in ("capacity", "start") if table[entry]]
        for name, ways in table["rules"].items():
            heading = f"rules.{toml_key(name)}"
            for way in ways if isinstance(ways, list) else [ways]:
                lines += ["", f"[[{heading}]]" if isinstance(ways, list) else f"[{heading}]"]
                lines += [f"{entry} = {toml_text(facts)}" for entry, facts in way.items()]
        text = "\n".join(lines) + "\n"
        if path is not None:
            write_atomically(path, text.encode())
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> Rules:
        """Read rules from a TOML file as `to_toml` writes it; if there is no ``name``, the label is the file's name."""
        path = Path(path)
        table = read_toml(path, "rules", or_any=True)
        try:
            rules = cls.from_dict(table)
            return rules if rules.label else replace(rules, label=as_utf8(path).stem)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def _array(self, *kinds: str) -> NDArray[np.int64]:
        """Return the count of each fact [R, A, F]: the largest among these kinds, such as ``"uses"``."""
        numbers = {fact: number for number, fact in enumerate(self.facts)}
        counts = np.zeros((len(self.rules), max(map(len, self.rules.values())), len(numbers)), np.int64)
        for rule, ways in zip(counts, self.rules.values(), strict=True):
            for row, way in zip(rule, ways, strict=False):
                for kind in kinds:
                    for fact, count in getattr(way, kind).items():
                        row[numbers[fact]] = max(row[numbers[fact]], count)
            rule[len(ways) :] = rule[len(ways) - 1]
        return freeze(counts)


def _facts_of(rules: Mapping[str, tuple[Alternative, ...]]) -> dict[str, None]:
    return {fact: None for ways in rules.values() for way in ways for counts in way for fact in counts}


def _bits(flags: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return flags [..., T] as the bits of integers [..., T / 64]; T is a multiple of 64."""
    return np.ascontiguousarray(np.packbits(flags, axis=-1)).view(np.uint64)
