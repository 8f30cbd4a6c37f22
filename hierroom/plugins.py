"""Loading of classes that users plug in by name."""

from __future__ import annotations

import importlib
import os
import sys
import sysconfig
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NoReturn

from hierroom.errors import DivergenceError, InputError


def load_plugin(spec: str, what: str, shipped: Iterable[str], group: str, kinds: str = "Class") -> Any:
    """Load the class, or what else a user's name refers to.

    Args:
        spec: name of an entry point in the group, or ``package.module:Class``; modules in the current folder are found
            too.
        what: kind of the class, for error messages, such as ``meta-controller``.
        shipped: names of the classes that ship with hierroom, for error messages.
        group: the group of entry points.
        kinds: what a module may hold of that kind, for error messages.

    Raises:
        InputError: if there is no such class or it cannot be loaded.
    """
    found = [*entry_points(group=group, name=spec)]
    if not found and ":" not in spec:
        known = f"{', '.join(shipped)}, an entry point of {group} or package.module:{kinds}"
        raise InputError(f"a {what} is one of {known}, not {spec!r}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        if found:
            return found[0].load()
        module, _, name = spec.partition(":")
        return getattr(importlib.import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"there is no module {error.name!r} for the {what} {spec!r}; it is looked for in the current folder too"
        ) from error
    except (Exception, SystemExit) as error:  # a user's code may raise anything, or be a script that ends
        raise InputError(f"the {what} {spec!r} cannot be loaded: {in_one_line(error)}") from error


@contextmanager
def own_code(name: str) -> Iterator[None]:
    """A context in which code of a user's own runs: whatever it raises becomes one line.

    Args:
        name: of what runs, for the message.

    Raises:
        InputError: if it raises anything; an error that is one line already stays as it is.
    """
    try:
        yield
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise_told(name, error)


def raise_told(name: str, error: BaseException) -> NoReturn:
    """Tell in one line what code of a user's own raised; for what runs so often that `own_code` would be felt.

    Args:
        name: of what ran, for the message.
        error: what it raised.

    Raises:
        InputError: always; an error that is one line already is raised as it is.
    """
    if isinstance(error, (InputError, DivergenceError)):
        raise error
    raise InputError(f"{name} fails: {in_one_line(error)}") from error


def in_one_line(error: BaseException) -> str:
    """The type and message of an error, without line breaks, and the last line of a user's own code that led to it."""
    text = f"{type(error).__name__}: {' '.join(str(error).split())}"
    places = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_NOT_OWN)]
    return f"{text} (line {places[-1].lineno} of {places[-1].filename})" if places else text


_LIBRARIES = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
_NOT_OWN = ("<", *(f"{folder}{os.sep}" for folder in (Path(__file__).parent, *_LIBRARIES)))
"""How the names of files begin that are not a user's own: this package's, Python's, and what is installed."""
