"""Mutation testing: does a module's own test fail if the module has one small error?

``python -m tests.mutation`` tries every mutant of the modules below, ``python -m tests.mutation gae options`` those of
some, and ``--sample 100`` a hundred of each. The module and those that import it run as ordinary Python, kernels too.
Each mutant is tried in a fork of this process, which has loaded what takes long, and lives in memory only: no file is
touched. The tests that noticed most mutants for their time come first. A mutant with which a test takes much more
CPU time than with the right module, such as an endless loop, is killed, too. Exit code 1 if one survives that
`explained` does not explain.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Mapping
from pathlib import Path

import pytest
from rich.progress import track

from ..architecture import PACKAGE, ROOT
from .explained import EXPLAINED, NOT_TRIED
from .in_memory import InMemory
from .mutants import mutants

TARGETS: Mapping[str, tuple[str, str]] = {
    "gae": ("learners/gae.py", "learner_gae"),
    "graph": ("goals/graph.py", "goals goals_enumeration"),
    "enumeration": ("goals/enumeration.py", "goals_enumeration"),
    "canonical": ("goals/canonical.py", "goals goals_enumeration complexity_graph_set"),
    "hitting": ("complexity/hitting.py", "complexity_hitting"),
    "elimination": ("complexity/elimination.py", "complexity_elimination"),
    "options": ("turns/ledger.py", "options option_ends turn_kernels crafted_states"),
    "turn_kernels": ("turns/kernels.py", "options option_ends turn_kernels"),
    "turns": ("turns/turns.py", "turns turns_masks turns_state turns_curriculum"),
    "step": ("worlds/escape_room/step_kernels.py", "world_keys world_minigrid world_batch features novelty"),
    "view": ("worlds/escape_room/view_kernels.py", "world_keys world_minigrid world_batch frontier"),
    "memory": ("worlds/escape_room/memory_kernels.py", "features frontier novelty world_keys"),
    "generation": ("worlds/escape_room/generation_kernels.py", "world_levels"),
    "random": ("worlds/escape_room/random_kernels.py", "world_random"),
    "batch": ("worlds/escape_room/batch_kernels.py", "world_batch"),
    "observations": ("worlds/escape_room/observations.py", "api_equal api_vector"),
    "state_check": ("worlds/escape_room/state_check.py", "state_check"),
    "rollouts": ("worlds/escape_room/rollout_kernels.py", "sampled_level"),
    "vector_arrays": ("envs/vector_arrays.py", "api_vector api_equal api_contract"),
    "oracle": ("worlds/escape_room/oracle.py", "world_oracle"),
    "frontier": ("worlds/escape_room/frontier.py", "frontier"),
    "features": ("worlds/escape_room/features.py", "features feature_values"),
    "goal_kernels": ("worlds/escape_room/goal_kernels.py", "turns_masks turn_kernels"),
    "sampling": ("learners/sampling.py", "learner_sampling"),
    "encoder": ("learners/fused/encoder_kernels.py", "learner_kernels"),
    "recurrent": ("learners/fused/recurrent_kernels.py", "learner_kernels"),
    "loss": ("learners/fused/loss_kernels.py", "learner_kernels"),
    "adam": ("learners/fused/adam_kernels.py", "learner_kernels"),
}
"""What is mutated, and the files of tests that are to notice."""
LEFT_OUT = (
    *("test_the_kernel_is_its_own_source", "test_as_ordinary_python"),  # of compiled kernels, or in other processes
    "test_ten_thousand_levels_are_solvable",  # takes minutes; the next in its file asks the same of fewer levels
    # Up to a hundred thousand rollouts, for hours as plain Python; others ask the same of a few.
    *("test_the_random_policy_succeeds", "test_information_is_as_computed", "test_gorp_succeeds"),
    "test_a_level_with_many_states",
    # Minutes of levels by the hundred, or of large ones; others ask the same of fewer and of smaller ones.
    *("test_a_step_never_gains_more_than_one", "accepted[False-63]", "accepted[True-63]"),
    "test_two_threads_do_what_one_does",
    "test_maps_and_frontiers_are_those_of_the_views_of_this_episode[63-graphs1]",
)
PRELOADED = (
    *("numpy", "scipy.sparse.linalg", "torch", "numba", "networkx", "pytest", "hypothesis", "gymnasium", "pettingzoo"),
    *("minigrid", "matplotlib.figure", "tyro", "rich.progress", "torch.utils.tensorboard", "PIL.Image"),
)
MOST_TIMES, LEAST_SECONDS = 4, 8
"""CPU time after which a mutant counts as killed: so many times what its test takes, and at least so long."""
MOST_SECONDS_TO_COLLECT = 60


class MostTellingFirst:
    """Of pytest: runs the tests that noticed most mutants for their time first, and remembers both.

    Args:
        path: of a file, in which one process leaves to the next what it saw.
    """

    def __init__(self, path: Path) -> None:
        seen = json.loads(path.read_text()) if path.exists() else {}
        self._path, self._is_first = path, not seen
        self._seconds, self._longest_setup = dict[str, float](seen.get("seconds", {})), seen.get("longest_setup", 0)
        self._noticed = Counter[str](seen.get("noticed"))
        self._fixtures = dict[str, float](seen.get("fixtures", {}))

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items.sort(key=self._seconds_to_notice)

    def _seconds_to_notice(self, test: pytest.Item) -> float:
        # One more mutant, as a test that has noticed none yet may do so; a tenth of a second, as no test is free.
        fixtures = sum(self._fixtures.get(name, 0) for name in getattr(test, "fixturenames", ()))
        return (self._seconds.get(test.nodeid, 0) + fixtures + 0.1) / (self._noticed[test.nodeid] + 1)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef) -> Generator[None, object, object]:
        started = time.monotonic()
        made = yield
        if self._is_first:
            self._fixtures[fixturedef.argname] = time.monotonic() - started
        return made

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        # What several tests need is made before the first of them, whichever that is.
        self._limit(item.nodeid, self._longest_setup)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> None:
        self._limit(item.nodeid, self._seconds.get(item.nodeid, 0))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if self._is_first:  # with the right module: a mutant may end a long test early
            if report.when == "setup":
                self._longest_setup = max(self._longest_setup, report.duration)
            else:
                self._seconds[report.nodeid] = self._seconds.get(report.nodeid, 0) + report.duration
        self._noticed[report.nodeid] += report.failed

    def _limit(self, nodeid: str, seconds: float) -> None:
        signal.signal(signal.SIGPROF, lambda *_: self._end(nodeid))
        signal.setitimer(signal.ITIMER_PROF, 0 if self._is_first else max(LEAST_SECONDS, MOST_TIMES * seconds))

    def _end(self, nodeid: str) -> None:
        self._noticed[nodeid] += 1
        self.pytest_sessionfinish()
        os._exit(pytest.ExitCode.TESTS_FAILED)

    def pytest_sessionfinish(self) -> None:
        seen = {"seconds": self._seconds, "fixtures": self._fixtures, "noticed": self._noticed}
        self._path.write_text(json.dumps(seen | {"longest_setup": self._longest_setup}))


def passes(target: str, source: str, seen: Path) -> bool:
    """Whether the tests of a module pass with another source in its place.

    Args:
        target: the module, in `TARGETS`.
        source: the other source.
        seen: a file of `MostTellingFirst`.
    """
    path, tests = TARGETS[target]
    finder = InMemory(PACKAGE / path, source)
    child = os.fork()
    if child == 0:
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS_TO_COLLECT)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        sys.meta_path.insert(0, finder)
        files = [str(next((ROOT / "tests").rglob(f"test_{one}.py"))) for one in tests.split()]
        chosen = ["-k", " and ".join(f"not {one}" for one in LEFT_OUT), *files]
        options = ["-x", "-q", "-p", "no:cacheprovider", f"--rootdir={ROOT}", *chosen]
        os._exit(int(pytest.main(options, plugins=[MostTellingFirst(seen)])))
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    # 1: a test failed; 2: no test could be collected, as the import failed; killed by the system: memory ran out.
    if code not in (0, 1, 2) and (code > 0 or code == -signal.SIGKILL):
        raise RuntimeError(f"pytest ended with exit code {code}")
    return code == 0


def survivors(target: str, folder: Path, sample: int | None) -> list[str]:
    """Try the mutants of a module; returns those that its tests do not notice and nobody has explained.

    Args:
        target: the module, in `TARGETS`.
        folder: for what is written meanwhile.
        sample: how many are tried, drawn at random; None: all.

    Raises:
        RuntimeError: if the tests fail as it is.
    """
    source = (PACKAGE / TARGETS[target][0]).read_text()
    seen = folder / f"{target}.json"
    # Once to measure the tests, and once as mutants meet them: in another order, with a limit to each.
    if not (passes(target, source, seen) and passes(target, source, seen)):
        raise RuntimeError(f"the tests of {target} fail without any error in it")
    every, explained, left = [one for one in mutants(source) if not one.before.startswith((*NOT_TRIED,))], 0, []
    tried = every if sample is None else random.Random(0).sample(every, min(sample, len(every)))
    known = EXPLAINED.get(target, {})
    started = time.monotonic()
    for mutant in track(tried, f"{target:<14}"):
        if not passes(target, mutant.source, seen):
            continue
        if mutant.before in known or f"{mutant.before}  ->  {mutant.after}" in known:
            explained += 1
        else:
            left.append(str(mutant))
            print(f"{target} {mutant}", flush=True)
    minutes = (time.monotonic() - started) / 60
    n_killed = len(tried) - explained - len(left)
    counts = f"{n_killed} killed, {explained} explained, {len(left)} left"
    print(f"{target}: {len(tried)} of {len(every)} mutants, {counts} ({minutes:.0f} min)", flush=True)
    return left


def main() -> int:
    """The command."""
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
        left = [mutant for target in named for mutant in survivors(target, Path(folder), options.sample)]
    return int(bool(left))


if __name__ == "__main__":
    raise SystemExit(main())
