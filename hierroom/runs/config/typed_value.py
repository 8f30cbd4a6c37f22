"""The entries of configs in files: what a TOML or JSON file may hold for each type that a config's entry has.

The types are those of the dataclasses. pydantic would turn 1.0 into 1 and "3" into 3, or in its strict mode refuse the
lists of TOML for tuples, and its messages take several lines; tyro reads words, not values.
"""

from __future__ import annotations

from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from hierroom.support.errors import InputError

_GRAPHS = str | dict | tuple[str | dict, ...]
"""What a file may hold for goal graphs: how they are named, or what they are in a table."""


def entry_types(part: type) -> dict[str, Any]:
    """The type that each entry of a part of a config has in a file, by the entry's name.

    Python takes any object as a reward; a file, like the command line, can only name one.

    Args:
        part: the part's dataclass.
    """
    types = {name: str | None if kind is Any else kind for name, kind in get_type_hints(part).items()}
    return types | {name: _GRAPHS for name in ("graph", "exclude") if name in types}


def typed_value(name: str, kind: Any, value: Any) -> Any:
    """The value that a file holds for an entry, as one of its type: lists as tuples, 1e6 for 1000000, 1 for 1.0.

    Args:
        name: of the entry, for the message.
        kind: its type, from `entry_types`.
        value: what the file holds; none is ``null`` in JSON, and in TOML, which has none, the text ``"None"``.
    """
    try:
        return _typed(kind, value)
    except (TypeError, OverflowError):  # a whole number may be too large for a float
        raise InputError(f"{name} must be {' or '.join(_kinds(kind))}, not {_shown(value)}") from None


def _shown(value: Any) -> str:
    try:
        return repr(value)
    except (ValueError, RecursionError):  # a whole number of thousands of digits, a list in a list in a list ...
        return f"a {type(value).__name__} of that size"


def _typed(kind: Any, value: Any) -> Any:
    """The value as one of a type's.

    Raises:
        TypeError: if it is none.
    """
    members = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        for member in sorted(members, key=lambda member: member is not NoneType):  # "None" is no text
            try:
                return _typed(member, value)
            except TypeError:
                continue
    elif get_origin(kind) is Literal:
        if isinstance(value, str) and value in members:
            return value
    elif get_origin(kind) is tuple and isinstance(value, (list, tuple)):
        return tuple(_typed(members[0], one) for one in value)
    elif kind is NoneType and value in (None, "None"):
        return None
    elif kind is float and type(value) is int:
        return float(value)
    elif kind is int and type(value) is float and value.is_integer():
        return int(value)
    elif isinstance(kind, type) and type(value) is kind:
        return value
    raise TypeError


def _kinds(kind: Any) -> list[str]:
    """What a file may hold for a type, in words."""
    members, origin = get_args(kind), get_origin(kind)
    if origin in (Union, UnionType):
        return [text for member in members for text in _kinds(member)]
    if origin is Literal:
        return [f"one of {', '.join(members)}"]
    if origin is tuple:
        return [f"a list of {', '.join(_kinds(members[0]))}".replace("a list of one of", "a list of")]
    words = {
        NoneType: '"None"',
        bool: "true or false",
        int: "a whole number",
        float: "a number",
        str: "a text",
        dict: "a table",
    }
    return [words[kind]]
