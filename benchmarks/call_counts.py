"""Count the files and functions of hierroom that `train --graph c` runs up to its first gradient step.

    python -m benchmarks.call_counts
    python -m benchmarks.call_counts --files

Whoever follows the command from its start to the first step of Adam meets them. Each function counts once, a function
inside another one too. Comprehensions belong to their function, and kernels count only where Python calls them.
"""

from __future__ import annotations

import inspect
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterable
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from types import CodeType, FrameType
from typing import Any
from unittest import mock

PACKAGE = Path(__file__).resolve().parents[1] / "hierroom"
ADAM = "hierroom.learners.fused.backend.adam_step"


class FirstStepError(Exception):
    """Raised where the first gradient step would be taken."""


def code_until_first_step() -> set[CodeType]:
    """Return all code of hierroom that the command runs, on all threads: of modules, classes and functions."""
    prefix, found = f"{PACKAGE}/", set[CodeType]()

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(prefix):
            found.add(frame.f_code)

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        from hierroom.__main__ import main

        with tempfile.TemporaryDirectory() as folder, suppress(FirstStepError), redirect_stdout(StringIO()):
            words = ["train", "--graph", "c", "--log", "none", "--out", f"{folder}/run"]
            with mock.patch(ADAM, side_effect=FirstStepError):
                main(words)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return found


def files_of(codes: Iterable[CodeType]) -> set[str]:
    """Return the paths of files in the package."""
    return {Path(code.co_filename).relative_to(PACKAGE).as_posix() for code in codes}


def main() -> None:
    """Print the counts, and the functions by folder, or with ``--files`` by file."""
    codes = code_until_first_step()
    inner = {code for code in codes if code.co_name != "<module>"}
    functions = {code for code in inner if code.co_flags & inspect.CO_NEWLOCALS and not code.co_name.startswith("<")}
    print(f"{len(files_of(codes))} files are imported")
    print(f"{len(files_of(inner))} files define a class or have a function that is called")
    print(f"{len(files_of(functions))} files have a function that is called")
    print(f"{len(functions)} functions are called")
    paths = (path for code in functions for path in files_of([code]))
    places = Counter(path if "--files" in sys.argv else path.rpartition("/")[0] or path for path in paths)
    for place, n in places.most_common():
        print(f"{n:6} {place}")


if __name__ == "__main__":
    main()
