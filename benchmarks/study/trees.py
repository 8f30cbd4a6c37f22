"""The tech trees of the conjecture, and every measure of each, computed before any training.

    python -m benchmarks.study.trees

Candidates are the workshops of 4 to 14 goals, every shape, ten seeds, that have at most 2000 markings and a solution
of at most 60 actions. Of these sixty are chosen on which `APART` rank differently: starting from a sample, one tree at
a time is exchanged for another wherever that lowers the greatest of their rank correlations. No training is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.study.correlations import rank_correlations
from benchmarks.study.random_work import random_steps
from hierroom.complexity import analyze
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text
from hierroom.worlds.workshop.layout import SHELF
from hierroom.worlds.workshop.recipes import book_of
from hierroom.worlds.workshop.shortest import Solver
from hierroom.worlds.workshop.tech_tree import Shape, tech_tree

GOALS = range(4, 15)
SEEDS = 10
MAX_MARKINGS = 2000
MAX_SHORTEST = 60
APART = ("goals", "exit_depth", "fewest", "hitting_time")
"""The measures that are to rank the trees differently."""


@dataclass(frozen=True)
class Options:
    """Choose and measure the trees of the conjecture.

    Args:
        trees: how many.
        tries: exchanges that are tried.
        seed: of the choice.
        out: the table.
    """

    trees: int = 60
    tries: int = 30_000
    seed: int = 0
    out: Path = Path("benchmarks/results/conjecture/measures.csv")


def measured_tree(n_goals: int, seed: int, shape: Shape) -> dict[str, str | float] | None:
    """Return the measures of a tech tree; None of one that is too large or too long."""
    rules = tech_tree(n_goals, seed, shape)
    recipes = book_of(rules).recipes
    things = np.zeros((3, len(recipes.start)), np.uint8)
    things[SHELF] = recipes.start
    shortest = Solver(recipes).next_way(things)[0]
    try:
        report = analyze(rules)
    except InputError:  # more markings than anybody unrolls
        return None
    if report.nodes > MAX_MARKINGS or not 0 < shortest <= MAX_SHORTEST:
        return None
    return {
        "graph": rules.name,
        "twin_of": "",
        "rooms": 0,  # which only EscapeRooms have
        "shape": shape,
        "markings": report.nodes,
        "shortest": shortest,
        "goals": n_goals,
        "exit_depth": report.exit_depth,
        "width": report.width,
        "fewest": report.fewest,
        "hitting_time": report.hitting_time,
        "expected_steps": report.expected_steps,
        "random_steps": random_steps(recipes),
        "settings": "exact",
    }


def chosen(columns: NDArray[np.float64], n: int, tries: int, seed: int) -> NDArray[np.int64]:
    """Return n of the rows [C, K] on which the columns rank as differently as exchanges of rows can make them."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(columns))
    inside, outside = order[:n], order[n:]
    best = _greatest(columns[inside])
    for _ in track(range(tries), "choosing", transient=True):
        i, o = rng.integers(n), rng.integers(len(outside))
        inside[i], outside[o] = outside[o], inside[i]
        greatest = _greatest(columns[inside])
        if greatest < best:
            best = greatest
        else:
            inside[i], outside[o] = outside[o], inside[i]
    return np.sort(inside)


def _greatest(columns: NDArray[np.float64]) -> float:
    return float(np.triu(rank_correlations(columns), 1).max())


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    every = [(n, seed, shape) for n in GOALS for shape in get_args(Shape) for seed in range(SEEDS)]
    found = [row for one in track(every, "measuring", transient=True) if (row := measured_tree(*one))]
    # What has all measures alike is most often the same tree with other names.
    rows = [*{tuple(f"{row[name]:.9g}" for name in (*APART, "random_steps")): row for row in reversed(found)}.values()][
        ::-1
    ]
    if len(rows) <= options.trees:
        raise InputError(f"there are {len(rows)} candidates, and more than {options.trees} are needed")
    columns = np.array([[row[name] for name in APART] for row in rows], float)
    places = chosen(columns, options.trees, options.tries, options.seed)
    rows = [rows[place] for place in places]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(options.out, csv_text(rows))
    print(f"{len(rows)} of {len(columns)} trees are in {options.out}; rank correlations:")
    for name, row in zip(APART, rank_correlations(columns[places]), strict=True):
        print(f"{name:>14}", *(f"{r:5.2f}" for r in row))
    return 0


if __name__ == "__main__":
    run(main)
