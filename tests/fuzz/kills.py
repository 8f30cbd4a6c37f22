"""Kill trainings, resume them, and compare every file with those of the same training left alone.

``python tests/fuzz/kills.py --kills 200`` kills 200 times. Every other kill is at a random moment, the others right
before a file operation; half of the writes among these are done by half. Many are killed again after they were resumed.
``--every`` kills before each file operation of a training once. The processes are forks of this one, in which
everything is loaded and compiled. Exit code 1 says that a file differs, and prints where.
"""

import argparse
import contextlib
import io
import itertools
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]  # the tests, and the package

import rich.progress  # noqa: E402
import torch  # noqa: E402
from places import Places  # noqa: E402
from rich.console import Console  # noqa: E402
from same_run import differences  # noqa: E402

from hierroom.support import cli  # noqa: E402
from hierroom.train import main as train  # noqa: E402

FLAGS = "--size 11 --max-steps 60 --num-envs 8 --sequence-length 16 --minibatches 2 --epochs 1 --hidden-size 8"
FLAGS += " --evaluations 3 --evaluation-episodes 8 --threads 1 --steps 2048"
RUNS: Mapping[str, str] = {
    "hippo": "--graph a",
    "ppo": "--graph a --method ppo",
    "ppo-bonus": "--graph a b --method ppo-bonus",
    "ppo-novelty": "--graph a --method ppo-novelty",
    "ppo-rnd": "--graph a --method ppo-rnd",
    "learned": "--graph a b --meta learned --meta-start-success 0 --meta-ppo.sequence-length 2 "
    "--meta-ppo.sequences-per-update 4 --meta-ppo.minibatches 2",
    "curriculum": "--graph rooms:3 --curriculum-stages 2",
}
"""Trainings, and the options that name them."""


@dataclass
class Left:
    """The result of the same training without a kill, with its number of file operations and seconds."""

    options: list[str]
    folder: Path
    operations: int
    seconds: float


def begin(options: list[str], places: Places | None, log: Path) -> int:
    """Begin the command in a fork of this process; returns the fork's number."""
    if process := os.fork():
        return process
    code = 99
    try:
        number = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(number, 1)
        os.dup2(number, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        if places is not None:
            places.install()
        try:
            cli.run(lambda: train(options))
        except SystemExit as ended:
            code = int(ended.code or 0)
        if places is not None and places.at is None:
            print(places.n, flush=True)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def end(process: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def leave_alone(name: str, folder: Path) -> Left:
    options = [*RUNS[name].split(), *FLAGS.split()]
    (folder / name).mkdir()
    whole, counted = folder / name / "run", folder / name / "counted"
    log = folder / name / "log"
    assert end(begin([*options, "--out", str(whole)], None, log)) == 0, log.read_text()
    started = time.perf_counter()
    assert end(begin([*options, "--out", str(counted)], Places(counted, None), log)) == 0, log.read_text()
    seconds = time.perf_counter() - started
    return Left(options, whole, int(log.read_text().splitlines()[-1]), seconds)


@dataclass(frozen=True)
class Kill:
    """The moment of a kill: before a file operation, within it if torn, or after some seconds."""

    at: int | None
    is_torn: bool = False
    seconds: float = 0

    def __str__(self) -> str:
        if self.at is None:
            return f"killed after {self.seconds:.2f} s"
        return f"killed {'in' if self.is_torn else 'before'} file operation {self.at}"


def every(lefts: Mapping[str, Left]) -> Iterator[tuple[str, list[Kill]]]:
    for name, left in lefts.items():
        yield from ((name, [Kill(at)]) for at in range(left.operations))


def drawn(lefts: Mapping[str, Left], rng: random.Random, done: Counter[str]) -> Iterator[tuple[str, Iterator[Kill]]]:
    """Draw kills, half at file operations and half at moments; the later ones kill a training that was resumed."""

    def draw(left: Left) -> Iterator[Kill]:
        for _ in range(rng.choice((1, 1, 2, 3))):
            if done["operation"] <= done["moment"]:
                yield Kill(rng.randrange(left.operations), rng.random() < 0.5)
            else:
                yield Kill(None, seconds=rng.uniform(0, left.seconds))

    for name in itertools.cycle(lefts):
        yield name, draw(lefts[name])


class Case:
    """A training that is killed and resumed until it ends; its folder has the same name, which is in pictures."""

    def __init__(self, left: Left, folder: Path) -> None:
        folder.mkdir()
        self.left, self.run, self.log = left, folder / "run", folder / "log"
        self.output: list[str] = []

    def kill(self, kill: Kill) -> bool:
        """Begin or resume it, and kill it; returns whether it was killed before it ended."""
        places = None if kill.at is None else Places(self.run, kill.at, kill.is_torn)
        begun, process = self._begin(places)
        if kill.at is None:
            time.sleep(kill.seconds)
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        code = end(process)
        self.output.append(f"{begun}, {kill if code else 'ended'}")
        if code not in (0, -signal.SIGKILL):
            raise AssertionError(f"exit code {code}: {self.log.read_text()[-500:]}")
        return code != 0

    def finish(self) -> list[str]:
        code = end(self._begin(None)[1])
        return differences(self.left.folder, self.run) if code == 0 else [f"exit code {code}: {self.log.read_text()}"]

    def _begin(self, places: Places | None) -> tuple[str, int]:
        """Begin or resume the run; return the word for it and the process's number."""
        if (self.run / "config.json").exists():
            return "resumed", begin(["--resume", str(self.run)], places, self.log)
        return "begun", begin([*self.left.options, "--out", str(self.run)], places, self.log)


def main() -> int:
    parser = argparse.ArgumentParser(description="Kill trainings, resume them, and compare every file.")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--every", action="store_true", help="instead, before each file operation of each training")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--runs", nargs="+", choices=RUNS, default=[*RUNS])
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    kills, resumed, wrong = Counter[str](), 0, []
    with tempfile.TemporaryDirectory() as name, rich.progress.Progress(console=Console(stderr=True)) as bar:
        folder = Path(name)
        with contextlib.redirect_stdout(io.StringIO()):  # compile and load what the forks need
            train([*RUNS["learned"].split(), *FLAGS.split(), "--out", str(folder / "warm")])
        lefts = {one: leave_alone(one, folder) for one in arguments.runs}
        total = sum(left.operations for left in lefts.values()) if arguments.every else arguments.kills
        task = bar.add_task("kills", total=total)
        cases = every(lefts) if arguments.every else drawn(lefts, random.Random(arguments.seed), kills)
        for number, (kind, planned) in enumerate(cases):
            case = Case(lefts[kind], folder / str(number))
            try:
                for kill in planned:
                    if sum(kills.values()) == total or not case.kill(kill):
                        break
                    kills["moment" if kill.at is None else "operation"] += 1
                    bar.update(task, completed=sum(kills.values()))
                found = case.finish()
            except AssertionError as error:
                found = [str(error)]
            if found:
                wrong.append(f"{kind}: {'; '.join(case.output)}: {'; '.join(found)}")
                bar.console.print(wrong[-1], markup=False)
            else:
                resumed += 1
                shutil.rmtree(case.run.parent)
            if sum(kills.values()) == total:
                break
    print(
        f"{sum(kills.values())} kills, {kills['operation']} of them at a file operation and {kills['moment']} at a "
        f"random moment, in {resumed + len(wrong)} trainings ({', '.join(arguments.runs)}): {resumed} ended with every "
        f"file equal, {len(wrong)} did not"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
