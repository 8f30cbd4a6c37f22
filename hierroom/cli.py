"""How every command ends: what went wrong is one line on standard error, and a wrong or too large input exit code 2."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from hierroom.errors import InputError


def run(command: Callable[[], int]) -> None:
    """Run a command and leave the process with its exit code, or with 2 where an input cannot be used."""
    try:
        code = command()
        sys.stdout.flush()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 2
    except FloatingPointError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 1
    except MemoryError as error:
        print(f"error: there is not memory enough: {error}", file=sys.stderr)
        code = 2
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        code = 130
    except BrokenPipeError:  # the reader, such as head, has seen enough; what is left must not be flushed at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)
