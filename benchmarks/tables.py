"""Put the tables of the sweeps in `benchmarks/sweeps/` into README and docs, from the rows in `benchmarks/results/`.

    python benchmarks/tables.py            # renew
    python benchmarks/tables.py --check    # exit code 1 where one differs

A table stands between the lines `<!-- sweep NAME -->` and `<!-- end of sweep -->`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hierroom.cli import run
from hierroom.errors import InputError
from hierroom.files import write_atomically
from hierroom.sweep.plan import read_plan
from hierroom.sweep.summary import CAPTION, summarise
from hierroom.sweep.table import SweepTable

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
PLACE = re.compile(r"(<!-- sweep (\w+) -->\n).*?(<!-- end of sweep -->\n)", re.DOTALL)


@dataclass(frozen=True)
class Options:
    """Renew the tables, or check them.

    Args:
        check: write nothing, and say which pages differ.
    """

    check: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def table(name: str) -> str:
    """The table of a sweep in Markdown, with the command that makes its rows.

    Raises:
        InputError: if there is no such sweep, or a run of it is not done.
    """
    plan = read_plan(ROOT / "benchmarks" / "sweeps" / f"{name}.toml")
    runs = plan.runs()
    rows = SweepTable(ROOT / "benchmarks" / "results" / name).of(runs)
    if len(rows) < len(runs):
        raise InputError(
            f"{len(rows)} of {len(runs)} runs of the sweep {name} are done; a page may have it when all are"
        )
    command = f"python -m hierroom.sweep benchmarks/sweeps/{name}.toml --out benchmarks/results/{name}"
    return f"\n`{command}` ({CAPTION}):\n\n{summarise(runs, rows, plan.metas).markdown()}\n\n"


def renewed(text: str) -> str:
    """A page with its tables as they are now."""
    return PLACE.sub(lambda place: place[1] + table(place[2]) + place[3], text)


def main() -> int:
    """The command."""
    options, n_other = tyro.cli(Options, description=__doc__), 0
    for page in PAGES:
        before = page.read_text()
        after = renewed(before)
        if before != after:
            n_other += 1
            print(f"{'differs' if options.check else 'renewed'}: {page.relative_to(ROOT)}")
            if not options.check:
                write_atomically(page, after.encode())
    return 1 if options.check and n_other else 0


if __name__ == "__main__":
    run(main)
