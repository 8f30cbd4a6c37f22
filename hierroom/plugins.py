"""What users plug in: how a class of their own is found by the name they type."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from hierroom.errors import InputError


def load_plugin(spec: str, what: str, shipped: Iterable[str], group: str) -> Any:
    """The class that a user's own name stands for.

    Args:
        spec: the name of an entry point in the group, or ``package.module:Class`` (the current folder is searched too).
        what: what it is to be, for people: ``meta-controller``.
        shipped: the names of those that ship, for people.
        group: a group of entry points.

    Raises:
        InputError: if there is no such class or it cannot be loaded.
    """
    found = [*entry_points(group=group, name=spec)]
    if not found and ":" not in spec:
        raise InputError(
            f"a {what} is one of {', '.join(shipped)}, an entry point of {group} or package.module:Class, not {spec!r}"
        )
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        if found:
            return found[0].load()
        module, _, name = spec.partition(":")
        return getattr(importlib.import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(f"there is no module {error.name!r} for the {what} {spec!r}") from error
    except Exception as error:  # whatever a user's own code may raise
        raise InputError(f"the {what} {spec!r} cannot be loaded: {in_one_line(error)}") from error


def in_one_line(error: Exception) -> str:
    """An error's type and message without line breaks."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
