"""Alternatives of a rule, as users and files give them."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

from hierroom.support.errors import InputError, require_number, shown

Facts: TypeAlias = str | list[str] | tuple[str, ...] | Mapping[str, int]
"""A fact, a list of facts, or the count of each fact."""
MAX_COUNT = 10**9
"""Largest count of a fact."""
_ENTRIES = ("needs", "uses", "gives")


class Alternative(NamedTuple):
    """One way to apply a rule: how many of each fact it needs, uses and gives."""

    needs: dict[str, int]
    uses: dict[str, int]
    gives: dict[str, int]


def read_alternatives(name: str, rule: object) -> tuple[Alternative, ...]:
    """Check one alternative of a rule or a list of them, and return them all."""
    ways = [rule] if isinstance(rule, (Mapping, Alternative)) else rule
    if not isinstance(ways, (list, tuple)) or not ways:
        raise InputError(f"rule {shown(name)} must be an alternative or a list of them, not {shown(rule)}")
    found = []
    for way in ways:
        if isinstance(way, Alternative):
            way = way._asdict()
        if not isinstance(way, Mapping) or not {*way} <= {*_ENTRIES}:
            wrong = [entry for entry in way if entry not in _ENTRIES] if isinstance(way, Mapping) else [way]
            holds = ", ".join(map(shown, wrong))
            raise InputError(f"rule {shown(name)} takes {', '.join(_ENTRIES)} and nothing else, not {holds}")
        counts = (read_counts(f"{entry!r} of rule {shown(name)}", way.get(entry, {}), low=1) for entry in _ENTRIES)
        found.append(Alternative(*counts))
    return tuple(found)


def read_counts(what: str, facts: object, low: int) -> dict[str, int]:
    """Check the counts of facts, given as a fact, a list of facts or a mapping, and return them."""
    if isinstance(facts, str):
        facts = [facts]
    if isinstance(facts, (list, tuple)):
        facts = Counter(read_name(f"a fact in {what}", fact) for fact in facts)
    if not isinstance(facts, Mapping):
        raise InputError(
            f"{what} must be a fact, a list of facts or a mapping from facts to counts, not {shown(facts)}"
        )
    for fact, count in facts.items():
        require_number(f"{what} for {read_name(f'a fact in {what}', fact)!r}", count, low, MAX_COUNT, is_whole=True)
    return {fact: int(count) for fact, count in facts.items()}


def read_name(what: str, name: object) -> str:
    """Check a name, such as that of a rule or a fact, and return it."""
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"{what} must be a text of one line, not {shown(name)}")
    return name


def plain_alternative(way: Alternative) -> dict[str, str | dict[str, int]]:
    """Return an alternative in the short form of users: a single fact with count 1 is only its name."""
    return {
        entry: next(iter(counts)) if [*counts.values()] == [1] else dict(counts)
        for entry, counts in way._asdict().items()
        if counts
    }


def toml_text(value: str | int | dict[str, int]) -> str:
    """Return a name or counts as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml_key(fact)} = {count}" for fact, count in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)  # names are printable, so TOML reads them too


def toml_key(name: str) -> str:
    """Return a name as a key of TOML."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else toml_text(name)


def first_names(names: Any) -> str:
    """Return the first of many names, for an error message."""
    names = [*names]
    return ", ".join(names[:8]) + ", ..." * (len(names) > 8)
