"""The forms in which users give one goal graph or a set, the same for every function that takes graphs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os.path import isfile
from pathlib import Path
from typing import Any

from hierroom.goals.graph import NAMED_GRAPHS, GoalGraph, is_graph_set
from hierroom.support.errors import InputError, shown

GraphSpec = GoalGraph | str | Path | Mapping[str, Any]
"""One goal graph, or a set of them: a letter, a name such as ``keys-0-1-exit-2``, a `GoalGraph`, a path to a TOML file,
what `GoalGraph.to_dict` gives, or ``rooms:4``, ``hitting_time:20..30`` or ``expected_steps:90..150``."""
GraphSpecs = GraphSpec | Sequence[GraphSpec]
"""One `GraphSpec`, or a list or tuple of them, which means all their graphs."""


def as_goal_graph(graph: GraphSpec) -> GoalGraph:
    """Return the goal graph of a `GraphSpec` that means a single graph."""
    if isinstance(graph, GoalGraph):
        return graph
    if isinstance(graph, Mapping):
        return GoalGraph.from_dict(graph)
    if isinstance(graph, str) and graph in NAMED_GRAPHS:
        return NAMED_GRAPHS[graph]
    if isinstance(graph, (str, Path)) and (Path(graph).suffix == ".toml" or isfile(graph)):
        return GoalGraph.from_toml(graph)
    if isinstance(graph, str) and graph.startswith("keys-"):
        return GoalGraph.named(graph)
    raise InputError(
        "a graph must be a letter from a to g, a name such as keys-0-1-exit-2, a GoalGraph or a path to a .toml file "
        "(where several are taken, also rooms:N, hitting_time:LOW..HIGH or expected_steps:LOW..HIGH), not "
        f"{shown(graph)}"
    )


def graph_specs(specs: GraphSpecs) -> tuple[GoalGraph | str, ...]:
    """Return letters and sets of graphs as they are, and everything else, such as files, as a `GoalGraph`."""
    several = specs if isinstance(specs, Sequence) and not isinstance(specs, str) else (specs,)
    return tuple(
        spec if isinstance(spec, str) and (spec in NAMED_GRAPHS or is_graph_set(spec)) else as_goal_graph(spec)
        for spec in several
    )


def plain_specs(specs: GraphSpecs) -> list[str | dict[str, Any]]:
    """Return the specs as plain types, for JSON."""
    return [spec.to_dict() if isinstance(spec, GoalGraph) else spec for spec in graph_specs(specs)]


def spec_names(specs: GraphSpecs) -> tuple[str, ...]:
    """Return the name of each spec."""
    return tuple(spec.name if isinstance(spec, GoalGraph) else spec for spec in graph_specs(specs))
