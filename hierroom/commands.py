"""How every command ends: a wrong input is one line on standard error and exit code 2."""

from __future__ import annotations

import sys
from collections.abc import Callable

from hierroom.errors import InputError


def run(command: Callable[[], int]) -> None:
    """Run a command and leave the process with its exit code, or with 2 where an input cannot be used."""
    try:
        code = command()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 2
    sys.exit(code)
