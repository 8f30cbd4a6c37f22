"""Fuzzing of command lines: each ends with exit code 0, or with 2 and one line or tyro's words.

``python -m tests.fuzz.command_lines --count 5000`` tries so many; the seed fixes them.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Mapping, Sequence

from hierroom.commands.compare import CompareArguments
from hierroom.commands.complexity import GraphArguments, RulesArguments
from hierroom.commands.evaluate import EvaluateArguments
from hierroom.commands.play import PlayArguments
from hierroom.commands.report import ReportArguments
from hierroom.commands.sweep import SweepArguments
from hierroom.commands.watch import WatchArguments
from hierroom.runs.config.config import TrainConfig

from .commands import SMALL_OPTIONS, TEXTS, end_of, report, wrong_end

START: Mapping[str, Sequence[str]] = {
    "train": SMALL_OPTIONS,
    "evaluate": ("run", "--episodes", "2"),
    "watch": ("run", "--text"),
    "compare": ("run", "--resamples", "100"),
    "complexity": (),
    "sweep": ("method=hippo,ppo", "size=11", "--graphs", "a", "--seeds", "2", "--metas", "random"),
    "report": ("run", "--played", "2", "--episodes", "1"),
    "play": ("--graph", "a"),
}
"""A right and fast command line of each command."""
NUMBERS = ("0", "-1", "1", "2", "7", "0.5", "1e-300", "1e300", "inf", "nan")
NUMBERS += tuple(map(str, (2**31, 2**63 - 1, 2**63, 10**20)))
_FLAT = [name for name in TrainConfig().entries if name != "env_index"]
_ARGUMENTS = {
    **{"evaluate": EvaluateArguments, "watch": WatchArguments, "compare": CompareArguments},
    **{"sweep": SweepArguments, "report": ReportArguments, "play": PlayArguments},
}
OPTIONS: Mapping[str, Sequence[str]] = {
    "train": [*_FLAT, "out", "resume", "config", "trust_run"],
    "complexity": [*vars(GraphArguments()), *vars(RulesArguments())],
    **{name: [*arguments.__dataclass_fields__] for name, arguments in _ARGUMENTS.items()},
}
ENTRIES: Mapping[str, Sequence[str]] = {"sweep": _FLAT}
"""Words of a command as entry=value, without dashes."""
WEIGHTS = {"train": 6, "complexity": 3, "sweep": 3, "evaluate": 2, "compare": 2, "play": 2}
"""Number of tries of a command; 1: the others."""


def command_lines(seed: int) -> Iterator[tuple[str, list[str]]]:
    """Yield command lines without end, each made from a right one by one to three changes."""
    rng = random.Random(seed)
    while True:
        name = rng.choices([*START], [WEIGHTS.get(name, 1) for name in START])[0]
        words = [*START[name]]
        for _ in range(rng.choice((1, 1, 2, 3))):
            option = f"--{rng.choice(OPTIONS[name]).replace('_', rng.choice('-_'))}"
            value = rng.choice(rng.choice((TEXTS, NUMBERS)))  # most options take numbers
            change = rng.randrange(8)
            if name in ENTRIES and rng.randrange(2):
                words.append(f"{rng.choice(ENTRIES[name])}={value}")
            elif change < 4:
                words += [option, value]
            elif change == 4:
                words += [f"{option}={value}"]
            elif change == 5:
                words += [rng.choice((option, value, option[:-1], f"--no-{option[2:]}", "--help", "-x"))]
            elif change == 6 and words:
                words.pop(rng.randrange(len(words)))
            elif words:
                words[rng.randrange(len(words))] = value
        if not takes_long(words):
            yield name, words


def takes_long(words: Sequence[str]) -> bool:
    text = " ".join(words).replace("=", " ").replace("_", "-")
    much = re.findall(r"--(?:episodes|most|resamples|max-steps|evaluation-episodes|played|seeds) +(\d{4,})", text)
    return any(int(number) < 2**40 for number in much if len(number) < 20)


def attempts(seed: int) -> Iterator[tuple[tuple[str, list[str]], str | None]]:
    """Yield command lines, each with its fault, or None."""
    for name, words in command_lines(seed):
        yield (name, words), wrong_end(*end_of(name, words))


if __name__ == "__main__":
    raise SystemExit(report(__doc__, "command lines", attempts))
