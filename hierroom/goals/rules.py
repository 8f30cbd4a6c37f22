"""Dependencies of any kind: rules that need, use and give facts, each with a count."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.support.errors import InputError, require_number, shown
from hierroom.support.files import write_atomically
from hierroom.support.reading import read_toml

Facts: TypeAlias = str | list[str] | tuple[str, ...] | Mapping[str, int]
"""A fact, a list of facts, or how many there are of each fact."""
MAX_COUNT = 10**9
"""Largest number of a fact."""
_ENTRIES = ("needs", "uses", "gives")


class Alternative(NamedTuple):
    """One way to apply a rule: how many of each fact it needs, uses and gives."""

    needs: dict[str, int]
    uses: dict[str, int]
    gives: dict[str, int]


@dataclass(frozen=True)
class Rules:
    """Rules by the names of their goals: what each needs, what it uses and takes away, and what it gives.

    A rule applies by the first of its alternatives for which everything is there. Of a fact that an alternative both
    needs and uses, the larger count must be there. It takes what it uses, then adds what it gives; of each fact, what
    goes beyond its capacity is lost::

        Rules(
            {
                "wood": {"gives": "wood"},
                "raft": [{"uses": {"wood": 3}, "gives": "raft"}, {"needs": "rope", "uses": "wood", "gives": "raft"}],
            },
            target="raft",
            capacity={"wood": 3},
        )

    A marking says how many there are of each fact. Arrays over rules, alternatives and facts are [R, A, F].

    Args:
        rules: for each goal one alternative or a list of them, each with any of ``needs``, ``uses`` and ``gives``: a
            fact, a list of facts, or a mapping from facts to counts.
        target: the fact to reach; all is done as soon as there is one.
        capacity: how many there can be of a fact; 1 of those that it leaves out.
        start: how many there are of a fact at first; none of those that it leaves out.
        label: the name of the rules in every output. It does not count for equality.
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
        rules = {_name("the name of a rule", name): _alternatives(name, rule) for name, rule in self.rules.items()}
        object.__setattr__(self, "rules", rules)
        facts = {fact: None for ways in rules.values() for way in ways for counts in way for fact in counts}
        capacity = _counts("the capacity", self.capacity, low=1)
        start = _counts("the start", self.start, low=0)
        for what, entries in (("the target", (self.target,)), ("the capacity", capacity), ("the start", start)):
            for fact in entries:
                if not isinstance(fact, str) or fact not in facts:
                    raise InputError(f"{what} must name facts of the rules ({_first(facts)}), not {shown(fact)}")
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
            _name("the name of rules", self.label)

    def __hash__(self) -> int:
        return hash((self.names, self.facts, self.target))

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
        """What must be there for each alternative, needed or used [R, A, F]; the last alternative fills up the rest."""
        return self._array(lambda way, fact: max(way.needs.get(fact, 0), way.uses.get(fact, 0)))

    @cached_property
    def used(self) -> NDArray[np.int64]:
        """What each alternative takes away [R, A, F]."""
        return self._array(lambda way, fact: way.uses.get(fact, 0))

    @cached_property
    def given(self) -> NDArray[np.int64]:
        """What each alternative gives [R, A, F]."""
        return self._array(lambda way, fact: way.gives.get(fact, 0))

    @cached_property
    def n_alternatives(self) -> NDArray[np.int64]:
        """Number of alternatives of each rule [R]."""
        return np.array([len(ways) for ways in self.rules.values()])

    @cached_property
    def limits(self) -> NDArray[np.int64]:
        """The capacity of each fact [F]."""
        return np.array([*self.capacity.values()])

    @property
    def start_marking(self) -> NDArray[np.int64]:
        """The marking at the start [F]."""
        return np.array([*self.start.values()])

    def apply_all(self, markings: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Apply each rule to markings [..., F]; one that does not apply leaves a marking as it is.

        Returns:
            the markings after each rule [..., R, F], and whether it applies [..., R].
        """
        before, (applies, ways) = np.asarray(markings)[..., None, :], self._choose(np.asarray(markings))
        rules = np.arange(len(self.rules))
        after = np.minimum(before - self.used[rules, ways] + self.given[rules, ways], self.limits)
        return np.where(applies[..., None], after, before), applies

    def moves(self, markings: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.integer]]:
        """Find the E moves from markings [M, F]: every rule that applies and changes a marking.

        Returns:
            for each move the index of its marking [E], its rule [E] and the marking after it [E, F], all of these in
            the smallest dtype that holds every marking.
        """
        change, limits = self._compact
        counts = np.asarray(markings).astype(limits.dtype)
        applies, ways = self._choose(counts)
        sources, rules = np.nonzero(applies)
        before = counts[sources]
        after = np.minimum(before + change[rules, ways[sources, rules]], limits)
        changes = np.any(after != before, axis=1)
        return sources[changes], rules[changes], after[changes]

    @cached_property
    def _compact(self) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
        """What changes, and the limits, in a dtype in which sums do not overflow."""
        dtype = np.min_scalar_type(-int(max(self.limits.max() + self.given.max(), self.used.max())) - 1)
        return (self.given - self.used).astype(dtype), self.limits.astype(dtype)

    @cached_property
    def _thresholds(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
        """The T facts and counts that alternatives ask for, and which alternative asks for which: [T, R * A]."""
        entries = np.nonzero(self.required)
        asked, inverse = np.unique(np.stack([entries[2], self.required[entries]], axis=1), axis=0, return_inverse=True)
        asks = np.zeros((len(asked), self.required[..., 0].size), np.float32)
        asks[inverse.ravel(), entries[0] * self.required.shape[1] + entries[1]] = 1
        return asked[:, 0], asked[:, 1], asks

    def _choose(self, markings: NDArray[np.integer]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Find whether each rule applies to markings [..., F], and by which of its alternatives: [..., R] both."""
        facts, counts, asks = self._thresholds
        lacks = (markings[..., facts] < counts).astype(np.float32) @ asks
        enough = (lacks == 0).reshape(*markings.shape[:-1], *self.required.shape[:2])
        return np.any(enough, axis=-1), enough.argmax(axis=-1)

    def apply(self, goal: str, marking: ArrayLike) -> NDArray[np.int64] | None:
        """Return the marking [F] after the rule of a goal, or None where it does not apply."""
        if goal not in self.rules:
            raise InputError(f"the rules are {_first(self.rules)}; there is no {shown(goal)}")
        after, applies = self.apply_all(marking)
        rule = self.names.index(goal)
        return after[rule] if applies[rule] else None

    def to_dict(self) -> dict[str, Any]:
        """Return the rules as plain types, as `from_dict` takes them."""
        rules = {name: [_plain(way) for way in ways] for name, ways in self.rules.items()}
        return {
            **({} if self.label is None else {"name": self.label}),
            "target": self.target,
            "capacity": {fact: count for fact, count in self.capacity.items() if count != 1},
            "start": {fact: count for fact, count in self.start.items() if count},
            "rules": {name: ways[0] if len(ways) == 1 else ways for name, ways in rules.items()},
        }

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Rules:
        """Return the rules of a table with ``rules`` and ``target``, perhaps ``capacity``, ``start`` and ``name``."""
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
        lines = [f"{entry} = {_toml(table[entry])}" for entry in ("name", "target") if entry in table]
        lines += [f"{entry} = {_toml(table[entry])}" for entry in ("capacity", "start") if table[entry]]
        for name, ways in table["rules"].items():
            heading = f"rules.{_key(name)}"
            for way in ways if isinstance(ways, list) else [ways]:
                lines += ["", f"[[{heading}]]" if isinstance(ways, list) else f"[{heading}]"]
                lines += [f"{entry} = {_toml(facts)}" for entry, facts in way.items()]
        text = "\n".join(lines) + "\n"
        if path is not None:
            write_atomically(path, text.encode())
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> Rules:
        """Read rules from a TOML file as `to_toml` writes it; without a ``name`` their label is the file's name."""
        path = Path(path)
        table = read_toml(path, "rules")
        try:
            rules = cls.from_dict(table)
            return rules if rules.label else replace(rules, label=path.stem)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def _array(self, count: Any) -> NDArray[np.int64]:
        most = max(map(len, self.rules.values()))
        ways = [(*ways, *ways[-1:] * (most - len(ways))) for ways in self.rules.values()]
        array = np.array([[[count(way, fact) for fact in self.facts] for way in row] for row in ways], np.int64)
        array.flags.writeable = False
        return array


def _alternatives(name: str, rule: object) -> tuple[Alternative, ...]:
    ways = [rule] if isinstance(rule, Mapping) else rule
    if not isinstance(ways, (list, tuple)) or not ways:
        raise InputError(f"rule {shown(name)} must be an alternative or a list of them, not {shown(rule)}")
    found = []
    for way in ways:
        if isinstance(way, Alternative):
            way = way._asdict()
        if not isinstance(way, Mapping) or not {*way} <= {*_ENTRIES}:
            holds = ", ".join(map(str, way)) if isinstance(way, Mapping) else shown(way)
            raise InputError(f"rule {shown(name)} takes {', '.join(_ENTRIES)} and nothing else, not {holds}")
        counts = (_counts(f"{entry!r} of rule {shown(name)}", way.get(entry, {}), low=1) for entry in _ENTRIES)
        found.append(Alternative(*counts))
    return tuple(found)


def _counts(what: str, facts: object, low: int) -> dict[str, int]:
    if isinstance(facts, str):
        facts = [facts]
    if isinstance(facts, (list, tuple)):
        facts = Counter(_name(f"a fact in {what}", fact) for fact in facts)
    if not isinstance(facts, Mapping):
        raise InputError(
            f"{what} must be a fact, a list of facts or a mapping from facts to counts, not {shown(facts)}"
        )
    for fact, count in facts.items():
        require_number(f"{what} for {_name(f'a fact in {what}', fact)!r}", count, low, MAX_COUNT, is_whole=True)
    return {fact: int(count) for fact, count in facts.items()}


def _name(what: str, name: object) -> str:
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"{what} must be a text of one line, not {shown(name)}")
    return name


def _plain(way: Alternative) -> dict[str, str | dict[str, int]]:
    """Return an alternative as users write it: a single fact by its name alone."""
    return {
        entry: next(iter(counts)) if [*counts.values()] == [1] else dict(counts)
        for entry, counts in way._asdict().items()
        if counts
    }


def _toml(value: str | int | dict[str, int]) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(fact)} = {count}" for fact, count in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)  # names are printable, so TOML reads them too


def _key(name: str) -> str:
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else _toml(name)


def _first(names: Any) -> str:
    names = [*names]
    return ", ".join(names[:8]) + ", ..." * (len(names) > 8)
