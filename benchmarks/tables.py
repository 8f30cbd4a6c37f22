"""Put the tables of the sweeps in `benchmarks/sweeps/` into README and docs, from the rows in `benchmarks/results/`.

    python -m benchmarks.tables            # renew
    python -m benchmarks.tables --check    # exit code 1 where one differs

A table stands between a line that names it, one of those below, and one such as `<!-- end of sweep -->`. NAME is that
of a sweep, and SEEDS how many of its first seeds are taken.

| line | table |
|---|---|
| `<!-- sweep NAME -->` | what was trained; with SEEDS where it is of the first ones only |
| `<!-- study NAME MEASURE ... -->` | how well measures predicted it, all measures where none is named |
| `<!-- hierarchy NAME SEEDS -->` | when hierarchy pays; with a milestone where it is not that of the rules |
| `<!-- factors NAME SEEDS REFERENCE -->` | what makes the difference |
| `<!-- levels NAME SEEDS -->` | whether hierarchy pays on other levels |
| `<!-- tuning NAME ... -->` | which settings the sweeps tuned |
| `<!-- paper SIZE SEEDS -->` | the paper's Table 3, ours on grids of one size |

What `study` shows was written by `benchmarks.study.statistics --out correlations.csv`, or, where a milestone stands
before the measures, with `--outcome steps_to_50 --out correlations_steps_to_50.csv`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Annotated, get_args

import tyro

from benchmarks.study import factors, hierarchy, levels, tuning
from benchmarks.study.correlations import Estimate
from benchmarks.study.statistics import measure_table, reliability_text, seeds_text
from benchmarks.study.tables import MEASURES_PATH, Row, known_measures, read_rows
from benchmarks.study.trained import Milestone
from hierroom.cli import run
from hierroom.errors import InputError
from hierroom.files import write_atomically
from hierroom.paper.cells import table_3
from hierroom.paper.published import METHODS
from hierroom.paper.runs import PaperRuns
from hierroom.paper.table3 import markdown
from hierroom.sweep.plan import Plan, PlannedRun, read_plan
from hierroom.sweep.summary import CAPTION, summarise
from hierroom.sweep.table import Row as SweepRow
from hierroom.sweep.table import SweepTable

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
KINDS = "sweep|study|hierarchy|factors|levels|tuning|paper"
PLACE = re.compile(rf"(<!-- ({KINDS}) ([\w ]+) -->\n).*?(<!-- end of \2 -->\n)", re.DOTALL)


@dataclass(frozen=True)
class Options:
    """Renew the tables, or check them.

    Args:
        check: write nothing, and say which pages differ.
    """

    check: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def sweep_table(name: str, n_seeds: str | None = None) -> str:
    """The table of a sweep in Markdown, with the command that makes its rows.

    Args:
        name: of the sweep.
        n_seeds: how many seeds, by default all of the plan.

    Raises:
        InputError: if there is no such sweep, or a run of it is not done.
    """
    plan = _plan(name)
    if n_seeds is not None:
        plan = replace(plan, seeds=int(n_seeds))
    runs = plan.runs()
    rows = done_rows(name, runs)
    only = "" if n_seeds is None else f" --seeds {n_seeds}"
    command = f"python -m hierroom.sweep benchmarks/sweeps/{name}.toml{only} --out benchmarks/results/{name}"
    return f"\n`{command}` ({CAPTION}):\n\n{summarise(runs, rows, plan.metas).markdown()}\n\n"


def study_table(name: str, *shown: str) -> str:
    """How well measures predicted what a sweep trained, a table for each method, with the command that makes it.

    Args:
        name: of the sweep.
        shown: the measures, the best first where none is named; before them a milestone that is not that of the rules.

    Raises:
        InputError: if the statistics were not computed, or not of such a measure, or graphs differ in their seeds.
    """
    outcome = shown[0] if shown and shown[0] in get_args(Milestone) else None
    measures = shown if outcome is None else shown[1:]
    folder, file = Path("benchmarks", "results", name), "correlations.csv"
    file = file if outcome is None else f"correlations_{outcome}.csv"
    rows = read_rows(ROOT / folder / file)
    seeds = {int(row[name]) for row in rows for name in ("seeds_min", "seeds_max")}
    if len(seeds) > 1:
        raise InputError(f"{folder / file} is of {min(seeds)} to {max(seeds)} seeds; make it of as many of each graph")
    (n_seeds,) = seeds
    only = "" if n_seeds == _plan(name).seeds else f" --seeds {n_seeds}"
    only += "" if outcome is None else f" --outcome {outcome}"
    command = f"python -m benchmarks.study.statistics {folder}/sweep.csv{only} --out {folder / file}"
    by_method: dict[str, list[Row]] = {}
    for row in rows:
        by_method.setdefault(row["method"], []).append(row)
    tables = [_study_table(method, rows, measures) for method, rows in by_method.items()]
    return f"\n`{command}`:\n\n" + "\n\n".join(tables) + "\n\n"


def _study_table(method: str, rows: Sequence[Row], shown: Sequence[str]) -> str:
    estimates = {
        (row["measure"], row["statistic"]): Estimate(*(float(row[name] or "nan") for name in ("value", "low", "high")))
        for row in rows
    }
    known = [row["measure"] for row in rows if row["statistic"] == "spearman" and row["measure"] != "twins"]
    if unknown := [name for name in shown if name not in known]:
        raise InputError(f"the measures of {method} are {', '.join(known)}; there is no {unknown[0]!r}")
    best = sorted(known, key=lambda name: -estimates[name, "spearman"].value)
    outcome = rows[0]["outcome"].replace("_", " ")
    unit = "%" if outcome.startswith("steps") else ""
    n_seeds = seeds_text(int(rows[0]["seeds_min"]), int(rows[0]["seeds_max"]))
    header = f"**{method}**, {outcome}{unit}, {rows[0]['graphs']} goal graphs, {n_seeds}:"
    lines = [header, "", measure_table(estimates, shown or best)]
    halves, twins = estimates["seeds", "halves"], estimates["twins", "spearman"]
    if not math.isnan(halves.value):
        lines += ["", reliability_text(halves)]
    if not math.isnan(twins.value):
        lines += ["", f"twins: {twins}"]
    return "\n".join(lines)


def hierarchy_table(name: str, n_seeds: str, outcome: str | None = None) -> str:
    """When hierarchy pays, by a sweep's first seeds, with the command that tells it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.
        outcome: the milestone, by default that of the study's rules.

    Raises:
        InputError: if a run of these seeds is not done, or there is no such milestone.
    """
    milestone = next((known for known in get_args(Milestone) if known == outcome), None)
    if milestone != outcome:
        raise InputError(f"a milestone must be one of {', '.join(get_args(Milestone))}, not {outcome!r}")
    path = _table_of_seeds(name, n_seeds)
    options = hierarchy.Options(path, outcome=milestone, seeds=int(n_seeds))
    measured = known_measures(ROOT / MEASURES_PATH)
    found = hierarchy.compare(read_rows(ROOT / path), measured, options)
    command = f"python -m benchmarks.study.hierarchy {path} --seeds {n_seeds}"
    command += "" if outcome is None else f" --outcome {outcome}"
    table = f"{hierarchy.markdown(found, options)}\n\n{hierarchy.sentence(found, measured, options)}"
    return f"\n`{command}`:\n\n{table}\n\n"


def factors_table(name: str, n_seeds: str, *reference: str) -> str:
    """What makes the difference, by a sweep's first seeds, with the command that tells it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.
        reference: the words of the name of the method that the others are held against.

    Raises:
        InputError: if a run of these seeds is not done, or there is no such method.
    """
    path, of = _table_of_seeds(name, n_seeds), " ".join(reference)
    options, measured = factors.Options(path, reference=of, seeds=int(n_seeds)), known_measures(ROOT / MEASURES_PATH)
    table = factors.markdown(factors.factors(read_rows(ROOT / path), measured, options))
    command = f'python -m benchmarks.study.factors {path} --reference "{of}" --seeds {n_seeds}'
    return f"\n`{command}`:\n\n{table}\n\n"


def levels_table(name: str, n_seeds: str) -> str:
    """Whether hierarchy pays on other levels, by a sweep's first seeds, with the command that tells it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of these seeds is not done, or a variant does not tell its levels.
    """
    path = _table_of_seeds(name, n_seeds)
    options, measured = levels.Options(path, seeds=int(n_seeds)), known_measures(ROOT / MEASURES_PATH)
    table = levels.markdown(levels.levels(read_rows(ROOT / path), measured, options))
    return f"\n`python -m benchmarks.study.levels {path} --seeds {n_seeds}`:\n\n{table}\n\n"


def tuning_table(*names: str) -> str:
    """The settings that sweeps tuned for each method, with the command that tells them.

    Args:
        names: of the sweeps.

    Raises:
        InputError: if a run of theirs is not done.
    """
    for name in names:
        done_rows(name, _plan(name).runs())
    paths = [Path("benchmarks", "results", name, "sweep.csv") for name in names]
    table = tuning.markdown(tuning.tuned([row for path in paths for row in read_rows(ROOT / path)]))
    return f"\n`python -m benchmarks.study.tuning {' '.join(map(str, paths))}`:\n\n{table}\n\n"


def _table_of_seeds(name: str, n_seeds: str) -> Path:
    """The table of a sweep, all of whose runs of seeds 0, 1, ... are done."""
    done_rows(name, [run for run in _plan(name).runs() if run.config.seed < int(n_seeds)])
    return Path("benchmarks", "results", name, "sweep.csv")


def paper_table(size: str, n_seeds: str) -> str:
    """The paper's Table 3 beside ours, with the command that prints it.

    Args:
        size: of the grid.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of it is not done.
    """
    out = Path("benchmarks", "results", "paper")
    paper = PaperRuns(ROOT / out, seeds=int(n_seeds), sizes=(int(size),))
    sweep = paper.sweep(paper.graphs, METHODS)
    rows = done_rows("paper", sweep.plan.runs())
    cells = table_3(rows, sweep.table.curves(), paper.sizes)
    command = f"python -m hierroom.paper table3 --sizes {size} --seeds {n_seeds} --out {out} --markdown"
    return f"\n`{command}`:\n\n{markdown(cells, paper.steps)}\n\n"


def _plan(name: str) -> Plan:
    return read_plan(ROOT / "benchmarks" / "sweeps" / f"{name}.toml")


def done_rows(name: str, runs: Sequence[PlannedRun]) -> list[SweepRow]:
    """The rows of a sweep's runs.

    Raises:
        InputError: if one is not done.
    """
    rows = SweepTable(ROOT / "benchmarks" / "results" / name).of(runs)
    if len(rows) < len(runs):
        raise InputError(
            f"{len(rows)} of {len(runs)} runs of the sweep {name} are done; a page may have it when all are"
        )
    return rows


def renewed(text: str) -> str:
    """A page with its tables as they are now."""
    return PLACE.sub(lambda place: place[1] + _table(place[2], place[3].split()) + place[4], text)


def _table(kind: str, words: Sequence[str]) -> str:
    makers: dict[str, Callable[..., str]] = {
        "sweep": sweep_table,
        "study": study_table,
        "hierarchy": hierarchy_table,
        "factors": factors_table,
        "levels": levels_table,
        "tuning": tuning_table,
        "paper": paper_table,
    }
    needed = signature(makers[kind])
    try:
        needed.bind(*words)
    except TypeError as error:
        raise InputError(f"<!-- {kind} {' '.join(words)} --> needs {', '.join(needed.parameters)}: {error}") from error
    numbers = [word for name, word in zip(needed.parameters, words, strict=False) if name in ("size", "n_seeds")]
    if unfit := [word for word in numbers if not word.isdecimal()]:
        raise InputError(f"<!-- {kind} {' '.join(words)} --> needs a whole number, not {unfit[0]!r}")
    return makers[kind](*words)


def main() -> int:
    """The command. A page with a table that cannot be made is left as it is, and the others are renewed."""
    options, n_other, refusals = tyro.cli(Options, description=__doc__), 0, []
    for page in PAGES:
        before, name = page.read_text(), page.relative_to(ROOT)
        try:
            after = renewed(before)
        except InputError as error:
            refusals.append(f"{name} is left as it is: {error}")
            continue
        if before != after:
            n_other += 1
            print(f"{'differs' if options.check else 'renewed'}: {name}")
            if not options.check:
                write_atomically(page, after.encode())
    if refusals:
        raise InputError("; ".join(refusals))
    return 1 if options.check and n_other else 0


if __name__ == "__main__":
    run(main)
