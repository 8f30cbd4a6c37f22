"""Count the files and functions of the package that a command passes through.

Four paths are counted. Beginning a run: from a second `hierroom.train` in one process to its first update, and the part
before the untrained agents are evaluated. A step of the controller in the AEC environment. Loading a checkpoint. A
reader who follows one of these opens so many files and reads so many functions; a hand-over is a call from a function
in one file to a function in another.

python -m benchmarks.call_counts
python -m benchmarks.call_counts step --by-file
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import CodeType, FrameType
from typing import Any
from unittest.mock import patch

import hierroom
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer

PACKAGE = str(Path(hierroom.__file__).parent) + os.sep
CONTROLLER = "controller_0"
COMPREHENSIONS = ("<listcomp>", "<dictcomp>", "<setcomp>")
"""They are functions of their own up to Python 3.11; here they are a part of the function that they stand in."""


class Calls:
    """Calls of functions of the package while it counts, of this thread alone.

    Attributes:
        functions: how often each function was called.
        handovers: how often a function in one file called a function in another, by the two.
    """

    def __init__(self) -> None:
        self.functions: Counter[CodeType] = Counter()
        self.handovers: Counter[tuple[CodeType, CodeType]] = Counter()

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Return a context in which calls are counted."""
        sys.setprofile(self._note)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _note(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(PACKAGE) or code.co_name in COMPREHENSIONS:
            return
        self.functions[code] += 1
        caller = frame.f_back
        while caller is not None and not caller.f_code.co_filename.startswith(PACKAGE):
            caller = caller.f_back  # a library that calls back
        if caller is not None and caller.f_code.co_filename != code.co_filename:
            self.handovers[caller.f_code, code] += 1

    @property
    def files(self) -> list[str]:
        """The files of the package that were entered, from the package's folder."""
        return sorted({code.co_filename.removeprefix(PACKAGE) for code in self.functions})

    def __str__(self) -> str:
        counts = {
            "files": len(self.files),
            "functions": len(self.functions),
            "hand-overs": len(self.handovers),
            "calls": self.functions.total(),
        }
        return ", ".join(f"{count:,} {name}" for name, count in counts.items())


def count_begin(until: str = "advance") -> Calls:
    """Run a second `hierroom.train` in one process until it calls a method of the trainer, by default an update."""
    calls = Calls()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        _train_until(until)
        with calls.counting():
            _train_until(until)
    return calls


def _train_until(method: str) -> None:
    class Begun(Exception):
        pass

    def stop(_: Trainer) -> None:
        sys.setprofile(None)
        raise Begun

    with suppress(Begun), patch.object(Trainer, method, stop):
        hierroom.train(graph="c")


def count_step() -> Calls:
    """Take a step of the controller in the AEC environment."""
    calls, env = Calls(), hierroom.env(graph="c")
    env.reset(seed=0)
    for _ in range(10):  # among them some of each agent
        if env.agent_selection == CONTROLLER:
            calls = Calls()
            with calls.counting():
                env.step(1)
        else:
            env.step(0)
    return calls


def count_load() -> Calls:
    """Load a checkpoint into a trainer."""
    calls = Calls()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        _train_until("advance")
        run = RunFolder.open(next(Path("runs").iterdir()))
        trainer = Trainer(run.config(), begins=False)
        trainer.load_state_dict(run.load_checkpoint())
        with calls.counting():
            trainer.load_state_dict(run.load_checkpoint())
    return calls


WAYS: dict[str, Callable[[], Calls]] = {
    "begin": count_begin,
    "setup": partial(count_begin, "evaluate"),
    "step": count_step,
    "load": count_load,
}


def main() -> None:
    """Print a line for each way."""
    parser = argparse.ArgumentParser(description="Count the files and functions that a command passes through.")
    parser.add_argument("ways", nargs="*", choices=[*WAYS, []], default=[])
    parser.add_argument("--by-file", action="store_true", help="list each file, its functions and their calls too")
    arguments = parser.parse_args()
    for way in arguments.ways or WAYS:
        calls = WAYS[way]()
        print(f"{way:<6} {calls}")
        for file in calls.files if arguments.by_file else ():
            own = {code: n for code, n in calls.functions.items() if code.co_filename == PACKAGE + file}
            named = ", ".join(f"{code.co_qualname} {n}" for code, n in own.items())
            print(f"       {file}: {named}")


if __name__ == "__main__":
    main()
