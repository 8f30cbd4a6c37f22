"""Kill trainings, resume them, and compare every file with those of the same training left alone.

``python tests/fuzz/kills.py --kills 200`` kills so often: every other time right before a file operation, where half
of these, if they are to write, do the first half of it, and every other time at a random moment. Many are killed again
after they were resumed. The processes are forks of this one, in which everything is loaded and compiled. Exit code 1
says that a file differs, and the place is told.
"""

import argparse
import builtins
import contextlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]  # the tests, and the package

import rich.progress  # noqa: E402
import torch  # noqa: E402
from rich.console import Console  # noqa: E402
from same_run import differences  # noqa: E402

from hierroom import cli  # noqa: E402
from hierroom.train import main as train  # noqa: E402

FLAGS = "--size 11 --max-steps 60 --num-envs 8 --sequence-length 16 --minibatches 2 --epochs 1 --hidden-size 8"
FLAGS += " --evaluations 3 --evaluation-episodes 8 --threads 1 --steps 2048"
RUNS: Mapping[str, str] = {
    "hippo": "--graph a",
    "ppo": "--graph a --method ppo",
    "ppo-bonus": "--graph a b --method ppo-bonus",
    "ppo-novelty": "--graph a --method ppo-novelty",
    "ppo-rnd": "--graph a --method ppo-rnd",
    "learned": "--graph a b --meta learned --meta-ppo.sequence-length 4 --meta-start-success 0",
    "curriculum": "--graph rooms:3 --curriculum-stages 2",
}
"""What is trained, and the options that say so."""
AUDITED = ("open", "os.rename", "os.remove", "os.mkdir", "os.truncate", "shutil.copyfile")
"""What Python says of itself before it changes a file; writing and syncing are told of by `_told`."""


class Places:
    """Counts the file operations below a folder, and kills this process before one of them.

    Args:
        folder: whose files are meant.
        at: number of the operation, from 0; None: none.
        is_torn: whether the first half of what it writes, if it does, is written.
    """

    def __init__(self, folder: Path, at: int | None, is_torn: bool = False) -> None:
        self.folder, self.at, self.is_torn, self.n = str(folder), at, is_torn, 0

    def audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """A hook for `sys.addaudithook`."""
        if event in AUDITED and isinstance(arguments[0], (str, os.PathLike)) and self.has(arguments[0]):
            if event == "open" and not (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR):
                return
            self.next()

    def has(self, path: Any) -> bool:
        return os.path.abspath(os.fspath(path)).startswith(self.folder)

    def next(self, half: Callable[[], object] = lambda: None) -> None:
        """Before an operation: end here, if it is the one."""
        if self.n == self.at:
            if self.is_torn:
                half()
            os.kill(os.getpid(), signal.SIGKILL)
        self.n += 1

    def install(self) -> None:
        """Have every operation of this process told to this object."""
        write, fsync, open_file = os.write, os.fsync, io.open

        def told_write(number: int, content: Any) -> int:
            if number > 2:
                self.next(lambda: write(number, bytes(content)[: len(content) // 2]))
            return write(number, content)

        def told_fsync(number: int) -> None:
            self.next()
            fsync(number)

        def told_open(file: Any, mode: str = "r", *arguments: Any, **named: Any) -> Any:
            opened = open_file(file, mode, *arguments, **named)
            if "b" in mode and not {*mode}.isdisjoint("wxa") and not isinstance(file, int) and self.has(file):
                return Told(opened, self)
            return opened

        os.write, os.fsync, io.open, builtins.open = told_write, told_fsync, told_open, told_open
        sys.addaudithook(self.audit)


class Told:
    """A file that tells of what is written to it."""

    def __init__(self, file: Any, places: Places) -> None:
        self._file, self._places = file, places

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> "Told":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def write(self, content: bytes) -> int:
        def half() -> None:
            self._file.write(content[: len(content) // 2])
            self._file.flush()

        self._places.next(half)
        return self._file.write(content)


@dataclass
class Left:
    """What the same training left alone leaves, in how many file operations and seconds."""

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
    """The exit code of a fork, or minus the signal that killed it."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def leave_alone(name: str, folder: Path) -> Left:
    """Train once without a kill, and once more to count."""
    options = [*RUNS[name].split(), *FLAGS.split()]
    (folder / name).mkdir()
    whole, counted = folder / name / "run", folder / name / "counted"
    log = folder / name / "log"
    assert end(begin([*options, "--out", str(whole)], None, log)) == 0, log.read_text()
    started = time.perf_counter()
    assert end(begin([*options, "--out", str(counted)], Places(counted, None), log)) == 0, log.read_text()
    seconds = time.perf_counter() - started
    return Left(options, whole, int(log.read_text().splitlines()[-1]), seconds)


class Case:
    """A training that is killed and resumed until it ends.

    Args:
        left: the same training, left alone.
        folder: a new one to work in; the run's has the name of the other's, which stands in its pictures.
        random: draws the places.
    """

    def __init__(self, left: Left, folder: Path, random: random.Random) -> None:
        folder.mkdir()
        self.left, self.run, self.log, self.random = left, folder / "run", folder / "log", random
        self.told: list[str] = []

    def kill(self, by_operation: bool) -> bool:
        """Begin or resume it, and kill it; returns whether it was killed before it ended."""
        resumes = (self.run / "config.json").exists()
        options = ["--resume", str(self.run)] if resumes else [*self.left.options, "--out", str(self.run)]
        places, place = None, ""
        if by_operation:
            at, is_torn = self.random.randrange(self.left.operations), self.random.random() < 0.5
            places, place = Places(self.run, at, is_torn), f"{'in' if is_torn else 'before'} file operation {at}"
        process = begin(options, places, self.log)
        if not by_operation:
            seconds = self.random.uniform(0, self.left.seconds)
            place = f"after {seconds:.2f} s"
            time.sleep(seconds)
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        code = end(process)
        self.told.append(f"{'resumed' if resumes else 'begun'}, {f'killed {place}' if code else 'ended'}")
        if code not in (0, -signal.SIGKILL):
            raise AssertionError(f"exit code {code}: {self.log.read_text()[-500:]}")
        return code != 0

    def finish(self) -> list[str]:
        """Resume it to its end; returns what differs."""
        resumes = (self.run / "config.json").exists()
        options = ["--resume", str(self.run)] if resumes else [*self.left.options, "--out", str(self.run)]
        code = end(begin(options, None, self.log))
        return differences(self.left.folder, self.run) if code == 0 else [f"exit code {code}: {self.log.read_text()}"]


def main() -> int:
    parser = argparse.ArgumentParser(description="Kill trainings, resume them, and compare every file.")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--runs", nargs="+", choices=RUNS, default=[*RUNS])
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    rng, kills, resumed, wrong = random.Random(arguments.seed), Counter(), 0, []
    with tempfile.TemporaryDirectory() as name, rich.progress.Progress(console=Console(stderr=True)) as bar:
        folder, task = Path(name), bar.add_task("kills", total=arguments.kills)
        with contextlib.redirect_stdout(io.StringIO()):  # compile and load what the forks need
            train([*RUNS["learned"].split(), *FLAGS.split(), "--out", str(folder / "warm")])
        lefts = {one: leave_alone(one, folder) for one in arguments.runs}
        number = 0
        while sum(kills.values()) < arguments.kills:
            kind = arguments.runs[number % len(arguments.runs)]
            case = Case(lefts[kind], folder / str(number), rng)
            number += 1
            try:
                for _ in range(rng.choice((1, 1, 2, 3))):  # the later ones kill a run that was resumed
                    by_operation = kills["operation"] <= kills["moment"]
                    if sum(kills.values()) == arguments.kills or not case.kill(by_operation):
                        break
                    kills["operation" if by_operation else "moment"] += 1
                    bar.update(task, completed=sum(kills.values()))
                found = case.finish()
            except AssertionError as error:
                found = [str(error)]
            if found:
                wrong.append(f"{kind}: {'; '.join(case.told)}: {'; '.join(found)}")
                bar.console.print(wrong[-1], markup=False)
            else:
                resumed += 1
                shutil.rmtree(case.run.parent)
    print(
        f"{sum(kills.values())} kills, {kills['operation']} of them at a file operation and {kills['moment']} at a "
        f"random moment, in {number} trainings ({', '.join(arguments.runs)}): {resumed} ended with every file equal, "
        f"{len(wrong)} did not"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
