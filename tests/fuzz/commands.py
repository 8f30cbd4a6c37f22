"""Runs a command in this process and describes a wrong end."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from unittest import mock

from rich.progress import track

from hierroom.__main__ import main
from hierroom.goals import GoalGraph
from hierroom.lab import play
from hierroom.lab.sweep import pool
from hierroom.runs import session
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import provenance
from hierroom.support.cli import run
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=30), num_envs=4, steps=512, evaluations=2, evaluation_episodes=4)
SMALL = SMALL.changed(minibatches=2, sequence_length=8, epochs=1, hidden_size=8)
SMALL_OPTIONS = [
    *("--graph", "a", "--size", "11", "--max-steps", "30", "--num-envs", "4", "--steps", "512", "--evaluations", "2"),
    *("--evaluation-episodes", "4", "--minibatches", "2", "--sequence-length", "8", "--epochs", "1"),
    *("--hidden-size", "8"),
]
"""`SMALL` on the command line."""

MANY_DIGITS = "9" * 5000
TEXTS = (
    *("", " ", "-", "--", "a", "c", "None", "none", "true", "0", "-1", "1", "7", "0.5", "nan", "inf", "-inf", "1e400"),
    *(str(2**31), str(2**62), str(2**63 - 1), str(2**63), str(10**20), MANY_DIGITS, "a" * 300, "é", "[/b]", "[red]x"),
    *(
        "two\nlines",
        "\x1b[31mred",
        "\udcff",
        "x\\",
        "$x$",
        "%s",
        "{0}",
        "../..",
        ".",
        "/",
        "/dev/null",
        "/proc/self/mem",
    ),
    *("run", "run/config.json", "nowhere", "own.toml", "deep.toml", "digits.toml", "chain.toml", "fork.toml", "x[/b]"),
    *("rooms:3", "rooms:99", "rooms:-1", "rooms:" + MANY_DIGITS, "hitting_time:8..13", "expected_steps:9..1"),
    *(
        "nowhere:Thing",
        "json:Nope",
        "json:",
        ":x",
        "a b:c d",
        "hierroom.meta:FixedDFS",
        "cpu",
        "meta",
        "hpu",
        "cuda:99",
    ),
    *("xla", "mps", "\u2028", "own.toml:x", "random", "oracle", "recurrent", "extrinsic", "view", "symbol"),
)
"""Values that may be given in the place of right ones."""


@contextlib.contextmanager
def world(folder: Path) -> Iterator[None]:
    """Work in a folder with a run and files that commands can name."""
    before, path = Path.cwd(), [*sys.path]
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)
    try:
        with mock.patch.object(provenance, "describe_git", return_value=None):
            Path("own.toml").write_text("gamma = 0.9\n", encoding="utf-8")
            Path("deep.toml").write_text(f"gamma = {'[' * 500}{']' * 500}\nkey_rooms = {'[' * 5000}", encoding="utf-8")
            Path("digits.toml").write_text(
                f"steps = {MANY_DIGITS}\nkey_rooms = [{MANY_DIGITS}]\nexit_room = 1\n", encoding="utf-8"
            )
            GoalGraph(tuple(range(1500)), 1500).to_toml("chain.toml")
            GoalGraph((0, 1, 1), 3).to_toml("fork.toml")
            if not Path("run").exists() and train_quietly(["--out", "run", *SMALL_OPTIONS]) != 0:
                raise RuntimeError("the run of the fuzzers could not be trained")
            if not Path("other").exists() and train_quietly(["--out", "other", *SMALL_OPTIONS, "--seed", "1"]) != 0:
                raise RuntimeError("the other run of the fuzzers could not be trained")
            shutil.copytree("run", "kept", dirs_exist_ok=True)
            yield
    finally:
        os.chdir(before)
        sys.path[:] = path


def train_quietly(argv: Sequence[str]) -> int:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return train([*argv])


def end_of(name: str, argv: Sequence[str]) -> tuple[object, str]:
    """Run a command without its training and its windows; return its exit code and what it wrote on standard error.

    For an exception these are its name and the traceback.
    """
    said, output = io.StringIO(), io.StringIO()
    code: object = None
    with (
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(output),
        mock.patch.object(session, "run_session", return_value=0),
        mock.patch.object(pool, "work_here", return_value=(event for event in ())),
        mock.patch.object(play, "App"),
    ):
        try:
            run(lambda: main([name, *argv]))
        except SystemExit as error:
            code = error.code
        except BaseException as error:
            return type(error).__name__, traceback.format_exc()
    return code, output.getvalue()


def wrong_end(code: object, output: str) -> str | None:
    """Describe the fault in an exit code and the text on standard error; None if there is none.

    Right are 0, or 2 and one line, or 2 and what tyro says of a word that is no option or no value of one.
    """
    errors = [line for line in output.splitlines() if line.startswith("error: ")]
    if code == 0:
        return f"exit code 0, and {errors[0]}" if errors else None
    if code != 2:
        return f"exit code {code!r}: {output}"
    if "For full helptext, " in output and not errors:
        return None
    if len(errors) != 1 or output.splitlines()[-1:] != errors or not errors[0].isprintable() or len(errors[0]) > 1100:
        return f"not one line: {output!r}"
    return None


Attempts = Callable[[int], Iterator[tuple[object, str | None]]]
"""A fuzzer: yields for a seed, without end, each try in the current folder with its fault, or None."""


def problems(attempts: Attempts, count: int, seed: int, folder: Path) -> Iterator[tuple[object, str | None]]:
    """Yield each try of a fuzzer in a folder with its fault, or None."""
    with world(folder):
        for attempt in islice(attempts(seed), count):
            yield attempt
            restore()


def report(description: str | None, what: str, attempts: Attempts) -> int:
    """Run a fuzzer as its command line says and print each fault; returns 1 if there is any."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=500, help="how many are tried")
    parser.add_argument("--seed", type=int, default=0, help="fixes them")
    arguments = parser.parse_args()
    n_wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        tries = problems(attempts, arguments.count, arguments.seed, Path(folder))
        for tried, problem in track(tries, "trying", arguments.count):
            if problem is not None:
                n_wrong += 1
                print(f"\n{tried!r:.2000}\n{problem[-3000:]}", flush=True)
    print(f"{arguments.count} of {what} (seed {arguments.seed}): {n_wrong} ended neither with 0 nor 2 and one line")
    return int(n_wrong > 0)


def restore() -> None:
    keep = {"run", "kept", "other", "own.toml", "deep.toml", "digits.toml", "chain.toml", "fork.toml"}
    for path in Path().iterdir():
        if path.name not in keep or path.name == "run":
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
    shutil.copytree("kept", "run")
