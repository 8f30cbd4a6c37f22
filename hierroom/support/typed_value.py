"""Entries of configs, checked by msgspec against the types and bounds of their dataclass, in memory and in files."""

from __future__ import annotations

import sys
from dataclasses import fields
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from msgspec import Meta

from hierroom.support.errors import InputError, shown

_GRAPHS = str | dict | tuple[str | dict, ...]
"""Forms of goal graphs and layouts in a file: names, or tables."""
_WORDS = {int: "a whole number", float: "a number", str: "a text", bool: "True or False", NoneType: "None"}

Positive = Annotated[float, Meta(gt=0, le=sys.float_info.max)]
"""A finite number above 0."""
NotNegative = Annotated[float, Meta(ge=0, le=sys.float_info.max)]
"""A finite number of at least 0."""
Fraction = Annotated[float, Meta(ge=0, le=1)]
"""A number from 0 to 1."""
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
"""A seed of random numbers."""


def check_entries(config: Any) -> None:
    """Check each entry of a frozen dataclass against its type and bounds; make NumPy's numbers Python's, lists tuples.

    Entries of other types than these, such as ``Any``, are left to the config.
    """
    for name, kind in _checked_types(type(config)).items():
        value = getattr(config, name)
        plain = value.item() if isinstance(value, np.generic) else tuple(value) if type(value) is list else value
        if plain is not value:
            object.__setattr__(config, name, plain)
        _convert(name, kind, plain)


@cache
def _checked_types(part: type) -> dict[str, Any]:
    hints = get_type_hints(part, include_extras=True)
    types = {entry.name: _without_extras(hints[entry.name]) for entry in fields(part)}
    return {name: kind for name, kind in types.items() if _is_plain(kind)}


def _is_plain(kind: Any) -> bool:
    members = [one for one in get_args(kind) if one is not Ellipsis and not isinstance(one, Meta)]
    return kind in _WORDS or get_origin(kind) is Literal or (bool(members) and all(map(_is_plain, members)))


def entry_types(part: type) -> dict[str, Any]:
    """Return the type that each field of a config's dataclass has in a file; names, also of rewards, are texts."""
    types = get_type_hints(part, include_extras=True)
    in_file = {name: _in_file(_without_extras(kind)) for name, kind in types.items()}
    return in_file | {name: _GRAPHS for name in ("graph", "exclude", "layout") if name in types}


def _without_extras(kind: Any) -> Any:
    if get_origin(kind) is not Annotated:
        return kind
    inner, *extras = get_args(kind)
    bounds = [extra for extra in extras if isinstance(extra, Meta)]
    return Annotated[inner, *bounds] if bounds else inner


def _in_file(kind: Any) -> Any:
    members = get_args(kind)
    if get_origin(kind) is Literal:
        return str
    if get_origin(kind) is tuple:
        return tuple[_in_file(members[0]), ...]
    if get_origin(kind) in (Union, UnionType):
        return Union[*map(_in_file, members)]
    return str | None if kind is Any else kind


def typed_value(name: str, kind: Any, value: Any) -> Any:
    """Convert a file's value to the type of its entry: a list to a tuple, 1e6 to 1000000, 1 to 1.0, "None" to None."""
    if value == "None" and NoneType in get_args(kind):
        return None
    is_whole = any(one is int or int in get_args(one) for one in (kind, *get_args(kind)))
    if type(value) is float and value.is_integer() and is_whole:
        value = int(value)
    return _convert(name, kind, value)


def _convert(name: str, kind: Any, value: Any) -> Any:
    try:
        return msgspec.convert(value, kind)
    except ValueError:  # of msgspec, or of a text that UTF-8 cannot hold
        raise InputError(f"{name} must be {_allowed(kind)}, not {shown(value)}") from None


def _allowed(kind: Any) -> str:
    """Return in words which values a type allows, such as ``a whole number from 1 to 5 or None``."""
    members = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(map(_allowed, members))
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, members))}"
    if get_origin(kind) is tuple:
        return f"a list, each {_allowed(members[0])}"
    if get_origin(kind) is Annotated:
        return f"{_allowed(members[0])} {_bounds(members[1])}"
    return _WORDS.get(kind, "a table")


def _bounds(bounds: Meta) -> str:
    low = f"of at least {bounds.ge}" if bounds.gt is None else f"above {bounds.gt}"
    if bounds.le is None or bounds.le == sys.float_info.max:
        return low
    bits = int(bounds.le + 1).bit_length() - 1
    high = f"2**{bits} - 1" if bits > 30 and bounds.le == 2**bits - 1 else f"{bounds.le:,}"
    return f"from {bounds.ge} to {high}" if bounds.gt is None else f"{low}, at most {high}"
