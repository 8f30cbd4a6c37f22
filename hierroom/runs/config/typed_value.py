"""The types of config entries in TOML and JSON files, and values checked against them by msgspec."""

from __future__ import annotations

from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec

from hierroom.support.errors import InputError, shown

_GRAPHS = str | dict | tuple[str | dict, ...]
"""Forms of goal graphs and layouts in a file: names, or tables."""


def entry_types(part: type) -> dict[str, Any]:
    """Return the type that each field of a config's dataclass has in a file; names, also of rewards, are texts."""
    types = {name: _in_file(kind) for name, kind in get_type_hints(part).items()}
    return types | {name: _GRAPHS for name in ("graph", "exclude", "layout") if name in types}


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
    try:
        if type(value) is float and value.is_integer() and int in (kind, *get_args(kind)):
            value = int(value)
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        text = str(error)
        raise InputError(f"{name} cannot be {shown(value)}: {text[0].lower()}{text[1:]}") from None
