"""Mutation testing: does a module's own test fail if the module has one small error?

``python -m tests.mutation`` tries every mutant of the modules below, ``python -m tests.mutation gae ledger`` those of
some, and ``--sample 100`` a hundred of each. The module and those that import it run as ordinary Python, kernels too.
Each mutant is tried in a fork of this process, which has loaded what takes long, and lives in memory only: no file is
touched. The tests that failed last come first. A mutant with which the tests take much more CPU time than with the
right module, such as an endless loop, counts as killed. Exit code 1 if more of a module survive than
CONTRIBUTING.md explains.
"""

from __future__ import annotations

import argparse
import importlib
import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

import pytest
from rich.progress import track

from ..architecture import PACKAGE, ROOT
from .in_memory import InMemory
from .mutants import mutants
from .targets import TARGETS, files_of_tests

NOT_TRIED = (
    "@njit(",  # for the compiler, which is not there
    "if TYPE_CHECKING:",  # for type checkers
    "if config.DISABLE_JIT:",  # decides whether NumPy warns that numbers overflow
)
"""Beginnings of lines whose mutants are not tried, in any module."""
LEFT_OUT = (
    "test_compiled_kernel_equals_its_own_source",  # of compiled kernels
    "test_ten_thousand_levels_are_solvable",  # takes minutes; the next in its file asks the same of fewer levels
    # Minutes of levels by the hundred, or of large ones; others ask the same of fewer and of smaller ones.
    *("test_one_step_shortens_the_path_by_at_most_one", "accepted[False-63]", "accepted[True-63]"),
    "test_two_threads_equal_one_thread",
    "test_explored_maps_and_frontiers_follow_the_views[63-graphs1]",
)
PRELOADED = (
    *("numpy", "scipy.sparse.linalg", "torch", "numba", "networkx", "pytest", "hypothesis", "gymnasium", "pettingzoo"),
    *("minigrid", "matplotlib.figure", "tyro", "rich.progress", "torch.utils.tensorboard", "PIL.Image"),
)
MOST_TIMES, LEAST_SECONDS = 4, 60
"""CPU time after which a mutant counts as killed: so many times what its tests take, and at least so long."""


def passes(target: str, source: str, folder: Path, seconds: float = 0) -> bool:
    """Return whether the tests of a target pass with another source of its module, within so many seconds if not 0.

    The folder holds pytest's cache, which runs the tests first that failed last.
    """
    path, tests, _ = TARGETS[target]
    finder = InMemory(PACKAGE / path, source)
    child = os.fork()
    if child == 0:
        signal.setitimer(signal.ITIMER_PROF, seconds)  # its signal ends the process
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        sys.meta_path.insert(0, finder)
        chosen = ["-k", " and ".join(f"not {one}" for one in LEFT_OUT), *files_of_tests(tests)]
        os._exit(int(pytest.main(["-x", "-q", "--ff", "-o", f"cache_dir={folder}", f"--rootdir={ROOT}", *chosen])))
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    # 1: a test failed; 2: no test could be collected, as the import failed; killed by the system: memory ran out.
    if code not in (0, 1, 2) and (code > 0 or code == -signal.SIGKILL):
        raise RuntimeError(f"pytest ended with exit code {code}")
    return code == 0


def survivors(target: str, folder: Path, sample: int | None) -> int:
    """Try all mutants of a target, or so many of them, print those that no test notices, and return their number."""
    source, before = (PACKAGE / TARGETS[target][0]).read_text(), os.times()
    if not passes(target, source, folder):
        raise RuntimeError(f"the tests of {target} fail without any error in it")
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    every, left = [one for one in mutants(source) if not one.before.startswith(NOT_TRIED)], 0
    tried = every if sample is None else random.Random(0).sample(every, min(sample, len(every)))
    started = time.monotonic()
    for mutant in track(tried, f"{target:<14}"):
        if passes(target, mutant.source, folder, max(LEAST_SECONDS, MOST_TIMES * seconds)):
            left += 1
            print(f"{target} {mutant}", flush=True)
    minutes = (time.monotonic() - started) / 60
    print(f"{target}: {len(tried)} of {len(every)} mutants, {left} left ({minutes:.0f} min)", flush=True)
    return left


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="*", help=f"of {', '.join(TARGETS)}; all by default")
    parser.add_argument("--sample", type=int, metavar="N", help="try N mutants of each module, drawn at random")
    options = parser.parse_args()
    named = options.modules or [*TARGETS]
    if unknown := {*named} - {*TARGETS}:
        parser.error(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(TARGETS)}")
    if options.sample is not None and options.sample < 1:
        parser.error(f"a sample has at least 1 mutant, not {options.sample}")
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    for name in PRELOADED:
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = folder
        left = {target: survivors(target, Path(folder) / target, options.sample) for target in named}
    return int(any(left[target] > TARGETS[target][2] for target in named))


if __name__ == "__main__":
    raise SystemExit(main())
