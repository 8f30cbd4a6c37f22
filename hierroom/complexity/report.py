"""Reports on how hard a goal graph or rules are to explore, computed before training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.augmented import AugmentedGraph, alike_nodes
from hierroom.complexity.chains.chain import Chain
from hierroom.complexity.chains.reach import expected_states
from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.rules_report import RulesReport
from hierroom.complexity.walk_report import WalkReport
from hierroom.goals import GoalGraph, Rules, as_goal_graph
from hierroom.support.errors import InputError, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@overload
def analyze(subject: GoalGraph | str | Path, drop_key: bool = ..., walk: Walk = ...) -> ComplexityReport: ...
@overload
def analyze(subject: Rules, *, walk: Walk = ...) -> RulesReport: ...
def analyze(subject: Any, drop_key: bool = False, walk: Walk = PAPER_WALK) -> ComplexityReport | RulesReport:
    """Return a report on how hard something is to explore by random walk; quantities are computed on first access.

    Args:
        subject: a goal graph (a letter `"a"` to `"g"`, a name such as `"keys-0-1-exit-2"`, a `GoalGraph`, or a path to
            a TOML file), or `Rules`, such as those of a task. A `Chain` has its numbers itself.
        drop_key: whether keys of a goal graph can be dropped.
        walk: the probabilities of one step.

    Examples:
        >>> [round(hierroom.complexity.analyze(graph).expected_steps) for graph in "abcg"]
        [28, 63, 74, 154]
    """
    if not isinstance(walk, Walk):
        raise InputError(f"a walk must be a Walk of three probabilities, not {shown(walk)}")
    if isinstance(subject, Rules):
        if drop_key:
            raise InputError("drop_key is of goal graphs, not of rules")
        return RulesReport(subject, walk)
    if not isinstance(subject, (GoalGraph, str, Path, Mapping)):
        raise InputError(f"analyze takes a goal graph or rules, such as task.rules, not {shown(subject)}")
    return ComplexityReport(as_goal_graph(subject), bool(drop_key), walk)


@dataclass(frozen=True)
class ComplexityReport(WalkReport):
    """Depth, width and passage times of a goal graph; created by `analyze`.

    Examples:
        >>> report = hierroom.complexity.analyze("c")
        >>> report.exit_depth, report.width, round(report.hitting_time, 2), round(report.expected_steps, 2)
        (4, 1, 15.07, 73.82)
    """

    graph: GoalGraph
    drop_key: bool = False
    walk: Walk = PAPER_WALK

    def __post_init__(self) -> None:
        _ = self.augmented  # refuses a graph that is too large

    @cached_property
    def augmented(self) -> AugmentedGraph:
        """The goal graph unrolled over the sets of open doors."""
        return AugmentedGraph(self.graph, self.drop_key, self.walk)

    @cached_property
    def chain(self) -> Chain:
        """The walk on the augmented graph, which computes all other quantities."""
        return Chain(self.augmented.weights, self.augmented.labels, self.augmented.start, self.augmented.goals)

    @property
    def name(self) -> str:
        """The graph's name."""
        return self.graph.name

    @property
    def exit_depth(self) -> int:
        """Number of goals (keys and doors) that must be achieved before the exit."""
        return self.graph.exit_depth

    @property
    def width(self) -> int:
        """Largest number of rooms at the same depth of the tree of keys."""
        return self.graph.width

    @property
    def edges(self) -> int:
        """Number of moves of the augmented graph, without restarts."""
        return len(self.augmented.edges)

    def expected_states(self, t: ArrayLike) -> NDArray[np.float64]:
        """See `Chain.expected_states`; it is computed for only one of several equivalent nodes."""
        return expected_states(self.chain.weights, self.chain.source, t, *alike_nodes(self.augmented))

    def described(self) -> dict[str, Any]:
        """Return a description of the graph, as plain types."""
        return {
            "graph": self.graph.name,
            "key_rooms": {f"key {room}": home for room, home in enumerate(self.graph.key_rooms, start=1)},
            "exit_room": self.graph.exit_room,
            "drop_key": self.drop_key,
        }

    @property
    def _are_states_counted(self) -> bool:
        return True  # fast enough, because many nodes are equivalent

    @property
    def _head(self) -> str:
        drop = "with" if self.drop_key else "without"
        return f"goal graph {self.graph.name}, {self.graph.n_rooms} rooms, {drop} drop"

    def _first_lines(self) -> list[tuple[str, str]]:
        return [
            ("key rooms", f"{list(self.graph.key_rooms)}, exit room {self.graph.exit_room}   (0 is the centre)"),
            ("exit depth", f"{self.exit_depth}"),
            ("width", f"{self.width}"),
            ("augmented graph", f"{self.nodes} nodes, {self.edges} edges"),
        ]

    def _figure(self) -> Figure:
        from hierroom.complexity.draw import figure_of_graph

        return figure_of_graph(self.augmented)
