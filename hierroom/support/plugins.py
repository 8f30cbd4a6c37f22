"""Load user-defined classes and functions by name."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hierroom.support.errors import LIBRARIES, InputError, user_code


def load_plugin(spec: str, what: str, shipped: Iterable[str], kinds: str = "Class") -> Any:
    """Load a user's class or function by its module, also from the current folder."""
    module, colon, name = spec.partition(":")
    if not colon:
        raise InputError(f"a {what} is one of {', '.join(shipped)} or package.module:{kinds}, not {spec!r}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    with user_code(f"the {what} {spec!r}", "cannot be loaded"):
        try:
            loaded = importlib.import_module(module)
        except ModuleNotFoundError as error:
            paths = dict.fromkeys(os.path.abspath(path) for path in sys.path if os.path.isdir(path))
            own = [path for path in paths if not path.startswith(tuple(LIBRARIES))]
            places = f"it is looked for in {', '.join(own)} and among installed packages"
            near = _near(error.name or "", [one.partition(":")[0] for one in shipped])
            raise InputError(f"there is no module {error.name!r} for the {what} {spec!r}{near}; {places}") from error
        try:
            return getattr(loaded, name)
        except AttributeError as error:
            raise AttributeError(f"{error}{_near(name, dir(loaded))}") from None


def _near(name: str, known: Iterable[str]) -> str:
    near = get_close_matches(name, [*known], n=1)
    return f" (is it {near[0]}?)" if near else ""
