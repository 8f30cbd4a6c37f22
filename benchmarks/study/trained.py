"""Runs on the study's goal graphs, by method, and the measures of those graphs, as arrays."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from benchmarks.study.tables import Row
from hierroom.support.errors import InputError

Milestone = Literal["steps_to_50", "steps_to_90", "steps_to_95", "steps_to_99"]
Outcome = Milestone | Literal["success_rate"]

MAX_UNREACHED_SHARE = 1 / 3
"""Largest share of graphs that never reach 95%; with more the steps to 50% are ranked."""
FEWEST_GRAPHS = 4
"""Fewer can be ranked alike by chance."""
SETTINGS = ("variant", "preset", "meta", "size")
"""Columns that make a method another one where its rows differ in them, if the table has them."""
MEASURES: Mapping[str, int] = {
    "goals": 1,
    "exit_depth": 1,
    "width": 1,
    "fewest": 1,
    "hitting_time": 1,
    "expected_steps": 1,
    "play_hitting_time": 1,
    "play_expected_steps": 1,
    "random_steps": 1,
    "play_success": -1,
    "random_success": -1,
    "effective_horizon": 1,
    "horizon_bound": 1,
    "samples": 1,
    "planning_window": 1,
    "covering_low": 1,
    "covering_high": 1,
    "pic": -1,
    "poic": -1,
    "escape": -1,
    "spectral_gap": -1,
    "mixing": 1,
    "commute": 1,
    "cover": 1,
}
"""The measures of the study, and 1 where more of it should be harder, -1 where it should be easier."""


@dataclass(frozen=True, eq=False)
class Trained:
    """The difficulty of each goal graph to one method, seed by seed.

    Args:
        method: its name, with the settings in which the table's rows of a method differ.
        graphs: [G] names of the graphs, without twins.
        outcomes: [G, S] the difficulty: steps, ``inf`` where never reached, or the rate of failure; ``nan`` after the
            last seed of a graph that has fewer.
        twins: [P] the graphs that have a twin, as indices into ``graphs``.
        twin_outcomes: [P, S] their twins' difficulty.
    """

    method: str
    graphs: tuple[str, ...]
    outcomes: NDArray[np.float64]
    twins: NDArray[np.int64]
    twin_outcomes: NDArray[np.float64]

    @property
    def never(self) -> int:
        """On how many graphs half of the seeds or more never reached the milestone."""
        return int(np.isinf(medians(self.outcomes)).sum())


def milestone_of(text: object, place: str) -> Milestone | None:
    """Return the milestone of a name; None of none.

    Args:
        text: the name, or None.
        place: where it stands, for the message.

    Raises:
        InputError: if there is no such milestone.
    """
    known = get_args(Milestone)
    if text is not None and text not in known:
        raise InputError(f"{place}: a milestone must be one of {', '.join(known)}, not {text!r}")
    return next((milestone for milestone in known if milestone == text), None)


def by_rule(rows: Sequence[Row], measured: Sequence[Row]) -> dict[Milestone, list[Trained]]:
    """Return the rows of a table by method, each by the milestone that docs/study-rules.md gives it.

    Args:
        rows: as for `read_trained`, with ``steps_to_50`` if a method needs it.
        measured: as for `read_trained`.

    Raises:
        InputError: as `read_trained`.
    """
    found: dict[Milestone, list[Trained]] = {"steps_to_95": [], "steps_to_50": []}
    for trained in read_trained(rows, measured, "steps_to_95"):
        if trained.never <= MAX_UNREACHED_SHARE * len(trained.graphs):
            found["steps_to_95"].append(trained)
        else:
            lower = read_trained(rows, measured, "steps_to_50")
            found["steps_to_50"] += [one for one in lower if one.method == trained.method]
    return found


def among(trained: Trained, graphs: Collection[str]) -> Trained:
    """Return the outcomes of some of the graphs, and of those of their twins that are there."""
    kept = [i for i, graph in enumerate(trained.graphs) if graph in graphs]
    pairs = [p for p, i in enumerate(trained.twins.tolist()) if i in kept]
    return Trained(
        trained.method,
        tuple(trained.graphs[i] for i in kept),
        trained.outcomes[kept],
        np.array([kept.index(int(trained.twins[p])) for p in pairs], np.int64),
        trained.twin_outcomes[pairs],
    )


def medians(outcomes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median of each row; ``inf`` where half of it is, or more.

    Args:
        outcomes: [G, S] with ``nan`` for what is missing; each row has at least one number.
    """
    ordered = np.sort(outcomes, axis=1)  # nan comes last
    n = (~np.isnan(outcomes)).sum(axis=1)[:, None]
    return sum(np.take_along_axis(ordered, at, axis=1)[:, 0] for at in ((n - 1) // 2, n // 2)) / 2  # type: ignore[return-value]


def read_trained(rows: Sequence[Row], measured: Sequence[Row], outcome: Outcome) -> list[Trained]:
    """Return the rows of a table of training runs, method by method.

    Args:
        rows: a row for each run: ``graph``, ``method``, ``seed``, the outcome, and ``steps`` if known.
        measured: rows of the table of measures, with each graph and its twin.
        outcome: the column that says how hard a graph was. An empty number of steps: never reached.

    Raises:
        InputError: if a column is missing, an outcome is no number, a graph is not measured, runs of a method are of
            different lengths, or the same seed stands twice.
    """
    missing = {"graph", "method", "seed", outcome}.difference(*rows[:1])
    if missing:
        raise InputError(f"there are no runs with {', '.join(sorted(missing))} in this table, or none of such graphs")
    twin_of = {row["graph"]: row["twin_of"] for row in measured}
    unknown = sorted({row["graph"] for row in rows} - twin_of.keys())
    if unknown:
        raise InputError(f"{len(unknown)} graphs are in no row of the measures, such as {unknown[0]!r}")
    found: dict[str, dict[str, dict[str, float]]] = {}
    lengths: dict[str, set[str]] = {}
    for row, method in zip(rows, method_names(rows), strict=True):
        seeds = found.setdefault(method, {}).setdefault(row["graph"], {})
        if row["seed"] in seeds:
            raise InputError(f"seed {row['seed']} of {method} on {row['graph']} stands in the table twice")
        seeds[row["seed"]] = _difficulty(row, outcome)
        lengths.setdefault(method, set()).add(row.get("steps", ""))
    for method, steps in lengths.items():
        if len(steps) > 1:
            raise InputError(f"runs of {method} are of different lengths: {', '.join(sorted(steps))} steps")
    return [_trained(method, graphs, twin_of) for method, graphs in found.items()]


def method_names(rows: Sequence[Row]) -> list[str]:
    """Return the name of each row's method: the method, and the settings in which its rows differ.

    A setting is added only to a name that rows of several values of it share: a variant that changes the size is called
    as the variant.

    Args:
        rows: of a table of training runs.

    Raises:
        InputError: if there is no row, a row has no method, or methods with other settings would have the same name.
    """
    if not rows:
        raise InputError("the table holds no training runs")
    if not all(row.get("method") for row in rows):
        raise InputError("each row of a table of training runs needs a method")
    names = [row["method"] for row in rows]
    for setting in SETTINGS:
        values: dict[str, set[str]] = {}
        for name, row in zip(names, rows, strict=True):
            values.setdefault(name, set()).add(row.get(setting, ""))
        names = [
            f"{name} {row[setting]}" if len(values[name]) > 1 and row.get(setting) else name
            for name, row in zip(names, rows, strict=True)
        ]
    settings_of: dict[str, tuple[str, ...]] = {}
    for name, row in zip(names, rows, strict=True):
        settings = (row["method"], *(row.get(setting, "") for setting in SETTINGS))
        if settings_of.setdefault(name, settings) != settings:
            raise InputError(
                f"runs of {' '.join(settings)} and of {' '.join(settings_of[name])} are both called {name}"
            )
    return names


def measures_of(graphs: Sequence[str], measured: Sequence[Row]) -> dict[str, NDArray[np.float64]]:
    """Return the measures of some graphs, each [G], with signs such that a larger value means harder.

    They are rounded to nine digits: isomorphic graphs differ in the last ones, and are to be ranked alike. What is not
    known of every graph, or is the same for all, is left out.

    Args:
        graphs: their names.
        measured: rows of the table of measures.
    """
    row_of = {row["graph"]: row for row in measured}
    found = {}
    for name, sign in MEASURES.items():
        texts = [row_of[graph].get(name, "") for graph in graphs]
        if all(texts):
            values = sign * np.array([float(f"{float(text):.9g}") for text in texts])
            if len(np.unique(values)) > 1:
                found[name] = values
    return found


def _trained(method: str, graphs: Mapping[str, Mapping[str, float]], twin_of: Mapping[str, str]) -> Trained:
    names = tuple(graph for graph in graphs if not twin_of[graph])
    pairs = [(names.index(twin_of[graph]), graph) for graph in graphs if twin_of[graph] in names]
    width = max(map(len, graphs.values()))

    def table(chosen: Sequence[str]) -> NDArray[np.float64]:
        rows = [[*graphs[graph].values()] for graph in chosen]
        return np.array([[*row, *[np.nan] * (width - len(row))] for row in rows]).reshape(len(rows), width)

    twins = np.array([index for index, _ in pairs], np.int64)
    return Trained(method, names, table(names), twins, table([graph for _, graph in pairs]))


def _difficulty(row: Row, outcome: Outcome) -> float:
    try:
        value = float(row[outcome] or "inf")
    except ValueError:
        value = np.nan
    if np.isnan(value) or value < 0 or (outcome == "success_rate" and value > 1):
        raise InputError(f"{outcome} of {row['method']} on {row['graph']} is no number of it: {row[outcome]!r}")
    return 1 - value if outcome == "success_rate" else value
