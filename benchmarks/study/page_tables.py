"""The study's tables as they stand in the docs, each with the command that prints it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from benchmarks.committed import ROOT, checked_path, done_rows, plan_of
from benchmarks.study import comparisons, factors, hierarchy, levels, result, tuning
from benchmarks.study.tables import Row, measures_for, read_rows
from benchmarks.study.trained import Milestone
from hierroom.support.errors import InputError


def measures_table(name: str, *shown: str) -> str:
    """Return the rank correlations of measures with what a sweep trained, the methods side by side, and the command.

    Args:
        name: of the sweep.
        shown: the measures; all, the best for the first method first, where none is named. Before them a milestone
            that is not that of the rules.

    Raises:
        InputError: if the statistics were not computed, or not of such a measure, or graphs differ in their seeds.
    """
    outcome, measures = milestone_and_words(shown)
    folder, file = Path("benchmarks", "results", name), correlations_file(outcome)
    rows = read_rows(ROOT / folder / file)
    seeds = {int(row[column]) for row in rows for column in ("seeds_min", "seeds_max")}
    if len(seeds) > 1:
        raise InputError(f"{folder / file} is of {min(seeds)} to {max(seeds)} seeds; make it of as many of each graph")
    (n_seeds,) = seeds
    only = "" if n_seeds == plan_of(name).seeds else f" --seeds {n_seeds}"
    only += "" if outcome is None else f" --outcome {outcome}"
    command = f"python -m benchmarks.study.statistics {folder}/sweep.csv{only} --out {folder / file}"
    table = result.side_by_side(result.results_of(rows), measures)
    return f"\n`{command}` prints these among others:\n\n{table}\n\n"


def milestone_and_words(words: Sequence[str]) -> tuple[Milestone | None, Sequence[str]]:
    """Return the milestone that the first word names, if it does, and the other words."""
    known = next((milestone for milestone in get_args(Milestone) if milestone in words[:1]), None)
    return (None, words) if known is None else (known, words[1:])


def correlations_file(milestone: Milestone | None) -> str:
    """Return the name of the table of correlations next to the rows of a sweep."""
    return "correlations.csv" if milestone is None else f"correlations_{milestone}.csv"


def hierarchy_table(name: str, n_seeds: str, *words: str) -> str:
    """Return when hierarchy pays, by a sweep's first seeds, with the command that prints it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.
        words: a milestone where it is not that of the study's rules, what tells the rows apart where that is not the
            exit depth, and the words of the name of the hierarchical method where that is not "hippo".

    Raises:
        InputError: if a run of these seeds is not done, or there is no such method.
    """
    known = (*get_args(Milestone), *get_args(hierarchy.Grouping))
    method = " ".join(word for word in words if word not in known) or hierarchy.Options.hierarchical
    outcome: Milestone | None = next((milestone for milestone in get_args(Milestone) if milestone in words), None)
    by: hierarchy.Grouping = next((one for one in get_args(hierarchy.Grouping) if one in words), "exit_depth")
    path = checked_path(name, n_seeds)
    options = hierarchy.Options(path, hierarchical=method, outcome=outcome, by=by, seeds=int(n_seeds))
    rows, measured = _rows(path)
    found = hierarchy.both_methods(rows, measured, options)
    table = hierarchy.text(found, hierarchy.compare(found, measured, options), measured, options)
    command = f"python -m benchmarks.study.hierarchy {path} --seeds {n_seeds}"
    command += "" if method == hierarchy.Options.hierarchical else f' --hierarchical "{method}"'
    command += "" if outcome is None else f" --outcome {outcome}"
    command += "" if by == "exit_depth" else f" --by {by}"
    return f"\n`{command}`:\n\n{table}\n\n"


def factors_table(name: str, n_seeds: str, *reference: str) -> str:
    """Return what makes the difference, by a sweep's first seeds, with the command that prints it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.
        reference: the words of the name of the method that the others are held against; before them a milestone that
            is not that of the rules.

    Raises:
        InputError: if a run of these seeds is not done, or there is no such method.
    """
    outcome, words = milestone_and_words(reference)
    path, method = checked_path(name, n_seeds), " ".join(words)
    options = factors.Options(path, reference=method, outcome=outcome, seeds=int(n_seeds))
    table = factors.markdown(factors.factors(*_rows(path), options))
    command = f'python -m benchmarks.study.factors {path} --reference "{method}" --seeds {n_seeds}'
    command += "" if outcome is None else f" --outcome {outcome}"
    return f"\n`{command}`:\n\n{table}\n\n"


def comparisons_table(name: str, n_seeds: str) -> str:
    """Compare methods of a sweep with each other by its first seeds, with the command that prints it.

    Args:
        name: of the sweep; benchmarks/study/NAME_comparisons.toml names the methods.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of these seeds is not done, or as `read_comparisons` or `compare_methods`.
    """
    path, file = checked_path(name, n_seeds), Path("benchmarks", "study", f"{name}_comparisons.toml")
    planned = comparisons.read_comparisons(ROOT / file)
    options = comparisons.Options(path, file, seeds=int(n_seeds))
    table = comparisons.markdown(planned, comparisons.compare(*_rows(path), planned, options))
    return f"\n`python -m benchmarks.study.comparisons {path} {file} --seeds {n_seeds}`:\n\n{table}\n\n"


def levels_table(name: str, n_seeds: str) -> str:
    """Return whether hierarchy pays on other levels, by a sweep's first seeds, with the command that prints it.

    Args:
        name: of the sweep.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of these seeds is not done, or a variant does not tell its levels.
    """
    path = checked_path(name, n_seeds)
    table = levels.markdown(levels.levels(*_rows(path), levels.Options(path, seeds=int(n_seeds))))
    return f"\n`python -m benchmarks.study.levels {path} --seeds {n_seeds}`:\n\n{table}\n\n"


def tuning_table(*names: str) -> str:
    """Return the settings that sweeps tuned for each method, with the command that prints them.

    Args:
        names: of the sweeps.

    Raises:
        InputError: if a run of theirs is not done.
    """
    for name in names:
        done_rows(name, plan_of(name).runs())
    paths = [Path("benchmarks", "results", name, "sweep.csv") for name in names]
    table = tuning.markdown(tuning.tuned([row for path in paths for row in read_rows(ROOT / path)]))
    return f"\n`python -m benchmarks.study.tuning {' '.join(map(str, paths))}`:\n\n{table}\n\n"


def _rows(path: Path) -> tuple[list[Row], list[Row]]:
    """Those of the table of training runs, and those of the measures."""
    return read_rows(ROOT / path), measures_for(ROOT / path)
