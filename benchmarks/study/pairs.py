"""How do two methods of a table compare? Pairs that a file names, on the same goal graphs.

    python -m benchmarks.study.pairs TABLE.csv PAIRS.toml

TABLE.csv is a table of training runs as `benchmarks.study.factors` takes it, and each ratio and its interval are those
of that command, with a reference for each method. PAIRS.toml holds an entry for each pair:

    [[pairs]]
    method = "ppo-bonus gamma 0.98"
    reference = "hippo gamma 0.98"
    outcome = "steps_to_50"  # where it is not the milestone of the rules
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

import tyro

from benchmarks.study import factors
from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.factors import Factor, beside
from benchmarks.study.markdown import table
from benchmarks.study.tables import MEASURES_PATH, Row, first_seeds, known_measures, read_rows
from benchmarks.study.trained import Milestone
from hierroom.cli import run
from hierroom.errors import InputError


@dataclass(frozen=True)
class Options:
    """Compare pairs of methods.

    Args:
        table: the training runs.
        pairs: the file that names them.
        measures: the measures of the goal graphs.
        seeds: only seeds 0, 1, ..., so many of them; all by default.
        bootstrap: how intervals are computed.
    """

    table: tyro.conf.Positional[Path]
    pairs: tyro.conf.Positional[Path]
    measures: Path = MEASURES_PATH
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)


@dataclass(frozen=True)
class Pair:
    """Two methods that are to be compared.

    Args:
        method: the name of the one.
        reference: that of the other, by whose steps those of the first are divided.
        outcome: the milestone; None: that of the study's rules.
    """

    method: str
    reference: str
    outcome: Milestone | None = None


def read_pairs(path: Path) -> list[Pair]:
    """The pairs that a file names.

    Raises:
        InputError: if it cannot be read, or an entry does not name two methods and nothing but a milestone beside them.
    """
    try:
        entries = tomllib.loads(path.read_text()).get("pairs", [])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"cannot read the pairs {path}: {error}") from error
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{path} names no pairs; each begins with [[pairs]]")
    return [_pair(entry, path) for entry in entries]


def _pair(entry: object, path: Path) -> Pair:
    names = {"method", "reference"}
    if not isinstance(entry, dict) or not names <= set(entry) <= names | {"outcome"}:
        raise InputError(f"a pair of {path} has a method, a reference and, if need be, an outcome, not {entry!r}")
    outcome = next((known for known in get_args(Milestone) if known == entry.get("outcome")), None)
    if outcome != entry.get("outcome"):
        raise InputError(f"an outcome must be one of {', '.join(get_args(Milestone))}, not {entry['outcome']!r}")
    for name in sorted(names):
        if not isinstance(entry[name], str):
            raise InputError(f"the name of a method is text, not {entry[name]!r}")
    return Pair(entry["method"], entry["reference"], outcome)


def compare(rows: Sequence[Row], measured: Sequence[Row], pairs: Sequence[Pair], options: Options) -> list[Factor]:
    """The method of each pair beside its reference.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        pairs: which methods.
        options: the seeds, and how intervals are computed.

    Raises:
        InputError: as `first_seeds` or `pair`.
    """
    rows = first_seeds(rows, options.seeds)
    return [beside(rows, measured, (one.method, one.reference), one.outcome, options.bootstrap) for one in pairs]


def markdown(pairs: Sequence[Pair], found: Sequence[Factor]) -> str:
    """A row for each pair."""
    rows = [[pair.method, pair.reference, *factors.cells(one)[1:5]] for pair, one in zip(pairs, found, strict=True)]
    return table(["method", "reference", *factors.HEADER[1:5]], rows)


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    pairs = read_pairs(options.pairs)
    print(markdown(pairs, compare(read_rows(options.table), known_measures(options.measures), pairs, options)))
    return 0


if __name__ == "__main__":
    run(main)
