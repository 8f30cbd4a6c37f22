"""Put the tables of the sweeps and other benchmarks into README and docs, from the rows in `benchmarks/results/`.

    python -m benchmarks.tables            # renew
    python -m benchmarks.tables --check    # exit code 1 where one differs

A table stands between a line that names it, one of those below, and one such as `<!-- end of sweep -->`. NAME is that
of a sweep, and SEEDS how many of its first seeds are taken.

| line | table |
|---|---|
| `<!-- sweep NAME -->` | what was trained; with SEEDS where it is of the first ones only |
| `<!-- measures NAME MEASURE ... -->` | how well measures predicted it, all measures where none is named |
| `<!-- hierarchy NAME SEEDS -->` | when hierarchy pays; with another milestone, `width` or `rooms`, or another method |
| `<!-- factors NAME SEEDS REFERENCE -->` | what makes the difference; with a milestone before the reference, as above |
| `<!-- comparisons NAME SEEDS -->` | the methods that benchmarks/study/NAME_comparisons.toml names next to each other |
| `<!-- levels NAME SEEDS -->` | whether hierarchy pays on other levels |
| `<!-- tuning NAME ... -->` | which settings the sweeps tuned |
| `<!-- paper SIZE SEEDS -->` | the paper's Table 3, ours on grids of one size |
| `<!-- result NAME -->` | what a benchmark measured that is no sweep, as it wrote it to benchmarks/results/NAME.csv |
| `<!-- cells SIZE SEEDS -->` | each number of that table as a row, for a CSV file |
| `<!-- matrix COLUMN NAME -->` | one column of a sweep, as `steps_to_95`: variants in rows, graphs in columns |

A table of many rows is a CSV file. After a link to it the same words say what is in it, as in
`[factors](../benchmarks/results/study/factors.csv)<!-- factors study 10 hippo -->`. The site shows those of
docs/tables.md.

A file benchmarks/results/NAME/notes.csv puts a column into the table of a sweep, with a text for each variant.

What `measures` shows was written by `benchmarks.study.statistics --out correlations.csv`, or, where a
milestone stands before the measures, with `--outcome steps_to_50 --out correlations_steps_to_50.csv`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.committed import ROOT, done_rows, plan_of
from benchmarks.paper_tables import cells_table, paper_table
from benchmarks.result_table import ResultTable, csv_of
from benchmarks.study.page_tables import (
    comparisons_table,
    factors_table,
    hierarchy_table,
    levels_table,
    measures_table,
    tuning_table,
)
from hierroom.lab.sweep.summary import Summary, summarise
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import markdown_table

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
PLACE = re.compile(r"^(<!-- (\w+) ([^>\n]+) -->\n)(?:(?!<!--).)*(<!-- end of \2 -->\n)", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"\]\(([^)\s]+\.csv)\)<!-- (\w+) ([^>\n]+) -->")


@dataclass(frozen=True)
class Options:
    """Renew the tables, or check them.

    Args:
        check: write nothing, and say which pages differ.
    """

    check: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def sweep_table(name: str, n_seeds: str | None = None) -> str:
    """Return the table of a sweep in Markdown, with the command that makes its rows.

    Args:
        name: of the sweep.
        n_seeds: how many seeds, by default all of the plan.

    Raises:
        InputError: if there is no such sweep, or a run of it is not done.
    """
    plan = plan_of(name)
    if n_seeds is not None:
        plan = replace(plan, seeds=int(n_seeds))
    only = "" if n_seeds is None else f" --seeds {n_seeds}"
    command = f"python -m hierroom sweep benchmarks/sweeps/{name}.toml{only} --out benchmarks/results/{name}"
    summary = summarise(plan.runs(), done_rows(name, plan.runs()), plan.metas)
    summary = with_notes(summary, ROOT / "benchmarks" / "results" / name / "notes.csv")
    return f"\n`{command}` ({summary.caption}):\n\n{summary.markdown()}\n\n"


def with_notes(summary: Summary, path: Path) -> Summary:
    """Return a summary with what a file says of each variant after its name, if there is one."""
    if not path.exists():
        return summary
    given = ResultTable.read(path)
    notes, (variant, *others) = {row[0]: row[1] for row in given.rows}, summary.headings
    lines = tuple((line[0], notes.get(line[0], ""), *line[1:]) for line in summary.lines)
    return replace(summary, headings=(variant, given.headings[1], *others), n_names=summary.n_names + 1, lines=lines)


def matrix_table(column: str, name: str) -> str:
    """Return one column of the table of a sweep in Markdown: a row for each variant, a column for each goal graph.

    Args:
        column: its heading, with `_` for a space and without a percent sign, such as `success` and `steps_to_95`.
        name: of the sweep.

    Raises:
        InputError: if the sweep has no such column or does not name its graphs, or as `sweep_table`.
    """
    runs = plan_of(name).runs()
    summary = summarise(runs, done_rows(name, runs))
    headings = [heading.replace(" ", "_").removesuffix("%") for heading in summary.headings]
    if missing := [word for word in ("graph", column) if word not in headings]:
        raise InputError(f"the table of {name} has the columns {', '.join(headings)}; there is no {missing[0]!r}")
    cells: dict[str, dict[str, str]] = {}
    for line in summary.lines:
        values = dict(zip(headings, line, strict=True))
        words = [values[word] for word in headings[: summary.n_names] if word != "graph"]
        cells.setdefault(", ".join(words) or name, {})[values["graph"]] = values[column]
    graphs = sorted({graph for row in cells.values() for graph in row})
    rows = [[label, *(row.get(graph, "") for graph in graphs)] for label, row in cells.items()]
    return f"\n{markdown_table([column.replace('_', ' '), *graphs], rows)}\n\n"


def result_table(name: str) -> str:
    """Return what a benchmark measured that is no sweep; the page names its command.

    Args:
        name: of the file that the benchmark wrote.

    Raises:
        InputError: if there is none.
    """
    return f"\n{ResultTable.read(ROOT / 'benchmarks' / 'results' / f'{name}.csv').markdown()}\n\n"


def renewed(text: str) -> str:
    """Return a page with its tables as they are now.

    Raises:
        InputError: if a table cannot be made, or the line that names it or its end is missing.
    """
    after, n_tables = PLACE.subn(lambda place: place[1] + _table(place[2], place[3].split()) + place[4], text)
    kinds = "|".join(MAKERS)
    first, last = (re.findall(rf"^<!-- {words}({kinds})\b", text, re.MULTILINE) for words in ("", "end of "))
    if not len(first) == len(last) == n_tables:
        raise InputError(f"{len(first)} lines name a table and {len(last)} end one, where {n_tables} tables are found")
    return after


def named_tables(text: str) -> list[tuple[str, list[str]]]:
    """Return the tables that a page names, each by its kind and the words after it."""
    found = [*PLACE.finditer(text), *FILE.finditer(text)]
    return [(place[2], place[3].split()) for place in found]


def files_of(page: Path) -> dict[Path, str]:
    """Return the CSV files that a page links to and says what is in, each with its text as it is now.

    Raises:
        InputError: if a table cannot be made, or is not one table.
    """
    found = {}
    for link, kind, words in FILE.findall(page.read_text(encoding="utf-8")):
        lines = [line for line in _table(kind, words.split()).splitlines() if line.startswith("|")]
        headings, rule, *rows = ([one.replace(r"\|", "|") for one in line[2:-2].split(" | ")] for line in lines)
        if any(len(row) != len(headings) or row == rule for row in rows):
            raise InputError(f"{kind} {words} is not one table")
        found[Path(os.path.normpath(page.parent / link))] = csv_of(headings, rows)
    return found


def _table(kind: str, words: Sequence[str]) -> str:
    if kind not in MAKERS:
        raise InputError(f"a table is one of {', '.join(MAKERS)}, not {kind}")
    needed = signature(MAKERS[kind])
    try:
        needed.bind(*words)
    except TypeError as error:
        raise InputError(f"<!-- {kind} {' '.join(words)} --> needs {', '.join(needed.parameters)}: {error}") from error
    numbers = [word for name, word in zip(needed.parameters, words, strict=False) if name in ("size", "n_seeds")]
    if unfit := [word for word in numbers if not word.isdecimal()]:
        raise InputError(f"<!-- {kind} {' '.join(words)} --> needs a whole number, not {unfit[0]!r}")
    return MAKERS[kind](*words)


MAKERS: Mapping[str, Callable[..., str]] = {
    "sweep": sweep_table,
    "measures": measures_table,
    "hierarchy": hierarchy_table,
    "factors": factors_table,
    "comparisons": comparisons_table,
    "levels": levels_table,
    "tuning": tuning_table,
    "paper": paper_table,
    "cells": cells_table,
    "result": result_table,
    "matrix": matrix_table,
}
"""Makers of the tables, by the word that names them in a page."""


def main() -> int:
    """Run the command. A page with a table that cannot be made is left as it is, and the others are renewed."""
    options, n_other, refusals = tyro.cli(Options, description=__doc__), 0, []
    for page in PAGES:
        before, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT)
        try:
            texts = {page: renewed(before), **files_of(page)}
        except InputError as error:
            refusals.append(f"{name} is left as it is: {error}")
            continue
        for path, after in texts.items():
            if not path.exists() or path.read_text(encoding="utf-8") != after:
                n_other += 1
                print(f"{'differs' if options.check else 'renewed'}: {path.relative_to(ROOT)}")
                if not options.check:
                    write_atomically(path, after.encode())
    if refusals:
        raise InputError("; ".join(refusals))
    return 1 if options.check and n_other else 0


if __name__ == "__main__":
    run(main)
