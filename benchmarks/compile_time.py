"""Time of compiling all kernels: kernel by kernel, in one process, into an empty folder.

    python -m benchmarks.compile_time --out before.csv
    python -m benchmarks.compile_time --before before.csv --out benchmarks/results/compile_time.csv

CPU time of this process, so that other work on the machine counts for little. A kernel's time is its own: that of the
functions it calls for the first time is in their rows, and that of NumPy's and Python's functions, which Numba brings
along, in one row.
"""

from __future__ import annotations

import inspect
import os
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import pandas as pd
import tyro
from numba.core import caching, codegen, event
from rich.console import Console

STAGES = {"nopython_type_inference": "types", "native_lowering": "lowering"}
"""Numba's passes with a column of their own; the others are together in one."""
LLVM = {
    "add_ir_module": "parsing",
    "_optimize_functions": "function passes",
    "finalize": "linking",
    "_optimize_final_module": "module passes",
    "_finalize_final_module": "machine code",
}
"""The methods of Numba's libraries of machine code, by what they do."""
OF_NUMBA = "(of NumPy and Python)"


@dataclass(frozen=True)
class Options:
    """Measure the compilation of every kernel.

    Args:
        out: a CSV file to write the table to.
        before: such a file of another version, to show its numbers, too.
    """

    out: Path | None = None
    before: Path | None = None


class Profile(event.Listener):
    """Adds up CPU time by kernel and stage, each without the stages inside it."""

    def __init__(self) -> None:
        self.seconds: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
        self.facts: dict[str, Counter[str]] = defaultdict(Counter)
        self._open: list[tuple[str, str]] = []
        self._last = time.process_time()

    def on_start(self, event: event.Event) -> None:
        """Begin a kernel, or a pass of the kernel that is compiled."""
        data: Any = event.data
        if event.kind == "numba:run_pass":
            self.begin(STAGES.get(data["name"].partition(" ")[0], "other passes"))
            return
        function = data["dispatcher"].py_func
        is_ours = function.__module__.startswith("hierroom.")
        name = f"{function.__module__.removeprefix('hierroom.')}.{function.__name__}" if is_ours else OF_NUMBA
        self.facts[name]["versions"] += 1
        self.facts[name]["lines"] = len(inspect.getsourcelines(function)[0]) if is_ours else 0
        if self._open:
            self.facts[self._open[-1][0]]["compiles"] += 1
        self._mark()
        self._open.append((name, "other passes"))

    def on_end(self, event: event.Event) -> None:
        """End it."""
        self.end()

    def begin(self, stage: str) -> None:
        """Begin a stage of the kernel that is compiled."""
        self._mark()
        self._open.append((self._open[-1][0] if self._open else OF_NUMBA, stage))

    def end(self) -> None:
        """End the last kernel or stage that has begun."""
        self._mark()
        self._open.pop()

    def _mark(self) -> None:
        now = time.process_time()
        if self._open:
            kernel, stage = self._open[-1]
            self.seconds[kernel][stage] += now - self._last
        self._last = now

    def timed(self, method: Callable[..., Any], stage: str) -> Callable[..., Any]:
        """Return a method that is a stage."""

        def timed(*arguments: Any, **settings: Any) -> Any:
            self.begin(stage)
            try:
                return method(*arguments, **settings)
            finally:
                self.end()

        return timed

    def table(self) -> pd.DataFrame:
        """Return a row for each kernel, the slowest first."""
        columns = ["types", "lowering", "other passes", *LLVM.values(), "saving"]
        seconds = pd.DataFrame.from_dict(self.seconds, orient="index").reindex(columns=columns).fillna(0.0)
        facts = pd.DataFrame.from_dict(self.facts, orient="index").reindex(columns=["lines", "versions", "compiles"])
        facts = facts.reindex(seconds.index).fillna(0).astype(int)
        table = pd.concat([facts, seconds.sum(axis=1).rename("seconds"), seconds], axis=1)
        return table.sort_values("seconds", ascending=False).rename_axis("kernel").round(3)


def measure() -> pd.DataFrame:
    """Compile all kernels and return the table of `Profile`."""
    from hierroom.commands.compile import play_as_trained, play_in_worlds, play_with_learners

    profile, library = Profile(), codegen.CPUCodeLibrary
    with ExitStack() as stack:
        for name, stage in LLVM.items():
            stack.enter_context(mock.patch.object(library, name, profile.timed(getattr(library, name), stage)))
        saved = profile.timed(caching.Cache.save_overload, "saving")
        stack.enter_context(mock.patch.object(caching.Cache, "save_overload", saved))
        for kind in ("numba:compile", "numba:run_pass"):
            stack.enter_context(event.install_listener(kind, profile))
        for play in (play_in_worlds, play_with_learners, play_as_trained):
            play()
    return profile.table()


def main(options: Options) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        from numba.core import config

        config.reload_config()
        table = measure()
    if options.before is not None:
        before = pd.read_csv(options.before, index_col="kernel")[["versions", "seconds"]].add_suffix(" before")
        table = before.join(table, how="outer").fillna(0).convert_dtypes()
        table = table.sort_values("seconds before", ascending=False)
    if options.out is not None:
        table.to_csv(options.out)
    table.loc["all"] = table.sum()
    with pd.option_context("display.max_rows", None, "display.width", 220, "display.max_columns", None):
        Console().print(table.to_string(float_format="{:.2f}".format), soft_wrap=True, markup=False)


if __name__ == "__main__":
    main(tyro.cli(Options))
