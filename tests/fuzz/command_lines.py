"""Fuzzing of command lines: each ends with exit code 0, or with 2 and one line.

``python -m tests.fuzz.command_lines --count 5000`` tries so many; the seed fixes them.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rich.progress import track

from hierroom.compare.__main__ import CompareArguments
from hierroom.complexity.__main__ import ComplexityArguments
from hierroom.evaluate import EvaluateArguments
from hierroom.training.config import TrainConfig
from hierroom.watch import WatchArguments

from .commands import SMALL_OPTIONS, TEXTS, problem_of, restore, world

START: Mapping[str, Sequence[str]] = {
    "train": SMALL_OPTIONS,
    "evaluate": ("run", "--episodes", "2"),
    "watch": ("run", "--text"),
    "compare": ("run", "--resamples", "100"),
    "complexity": (),
    "paper": ("table2",),
}
"""A command line of each command that is right, and soon done."""
_FLAT = [name for name in TrainConfig().entries if name not in ("env", "agents", "ppo", "meta_ppo", "env_index")]
OPTIONS: Mapping[str, Sequence[str]] = {
    "train": [
        *_FLAT,
        "out",
        "resume",
        "config",
        "trust_run",
        *(f"meta_ppo.{name}" for name in vars(TrainConfig().ppo)),
    ],
    **{
        name: [*arguments.__dataclass_fields__]
        for name, arguments in {
            "evaluate": EvaluateArguments,
            "watch": WatchArguments,
            "compare": CompareArguments,
            "complexity": ComplexityArguments,
        }.items()
    },
    "paper": ["csv"],
}


def command_lines(count: int, seed: int) -> Iterator[tuple[str, list[str]]]:
    """Command lines, each made from a right one by one to three changes.

    Args:
        count: how many.
        seed: fixes them.
    """
    rng = random.Random(seed)
    weights = {"train": 6, "evaluate": 2, "watch": 1, "compare": 2, "complexity": 3, "paper": 1}
    for _ in range(count):
        name = rng.choices([*weights], [*weights.values()])[0]
        words = [*START[name]]
        for _ in range(rng.choice((1, 1, 2, 3))):
            option = f"--{rng.choice(OPTIONS[name]).replace('_', rng.choice('-_'))}"
            value = rng.choice(TEXTS)
            change = rng.randrange(8)
            if change < 4:
                words += [option, value]
            elif change == 4:
                words += [f"{option}={value}"]
            elif change == 5:
                words += [rng.choice((option, value, option[:-1], f"--no-{option[2:]}", "--help", "-x"))]
            elif change == 6 and words:
                words.pop(rng.randrange(len(words)))
            elif words:
                words[rng.randrange(len(words))] = value
        yield name, words


def problems(count: int, seed: int, folder: Path) -> Iterator[tuple[str, list[str], str | None]]:
    """Each command line and what is wrong with how it ended, or None.

    Args:
        count: how many.
        seed: fixes them.
        folder: to try them in.
    """
    with world(folder):
        for name, words in command_lines(count, seed):
            yield name, words, problem_of(name, words)
            restore()


def main() -> int:
    """Print what goes wrong; returns 1 if anything does."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    n_wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        tried = problems(arguments.count, arguments.seed, Path(folder))
        for name, words, problem in track(tried, "trying", arguments.count):
            if problem is not None:
                n_wrong += 1
                print(f"\n{name} {words!r:.2000}\n{problem[-3000:]}", flush=True)
    print(f"{arguments.count} command lines, {n_wrong} ended otherwise than with 0, or with 2 and one line")
    return int(n_wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
