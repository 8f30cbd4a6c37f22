"""The report of how hard a goal graph is to explore, computed before training."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.augmented import AugmentedGraph, alike_nodes
from hierroom.complexity.chains.chain import Chain, EdgeSensitivity
from hierroom.complexity.chains.reach import expected_states
from hierroom.complexity.walk import PAPER_WALK, TABLE_READING, Reading, Walk
from hierroom.goals import GoalGraph, as_goal_graph
from hierroom.support.tables import html_table

REPORT_TIMES = (10, 100, 1000)
"""Numbers of steps at which reports evaluate the curves; an episode is truncated after 1000."""
NUMBERS = ("exit_depth", "width", "nodes", "edges", "hitting_time", "expected_steps", "std")


def by_time(curve: Callable[[ArrayLike], NDArray[np.float64]], times: Sequence[int]) -> dict[str, float]:
    """Evaluate a curve at some times, for a table."""
    return dict(zip(map(str, times), curve(times).tolist(), strict=True))


def analyze(
    graph: GoalGraph | str | Path,
    drop_key: bool = False,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
) -> ComplexityReport:
    """Compute how hard a goal graph is to explore by the paper's random walk, each quantity on first access.

    Args:
        graph: a letter `"a"` to `"g"`, a name such as `"keys-0-1-exit-2"`, a `GoalGraph`, or a path to a TOML file.
        drop_key: whether keys can be dropped.
        walk: the probabilities of one step.
        reading: interpretation of the paper's augmented graph.
    """
    return ComplexityReport(as_goal_graph(graph), bool(drop_key), walk, reading)


@dataclass(frozen=True)
class ComplexityReport:
    """Depth, width and passage times of a goal graph; created by `analyze`.

    Two numbers say how long it takes to reach the exit. `hitting_time` is the value in the paper's Table 2, the
    least-squares solution of its Laplacian system, which saturates near 1 / 0.01 = 100. `expected_steps` is the true
    mean number of steps of the same walk, which does not saturate.
    """

    graph: GoalGraph
    drop_key: bool = False
    walk: Walk = PAPER_WALK
    reading: Reading = TABLE_READING

    def __post_init__(self) -> None:
        _ = self.augmented  # refuses a graph that is too large

    @cached_property
    def augmented(self) -> AugmentedGraph:
        """The goal graph unrolled over the sets of open doors."""
        return AugmentedGraph(self.graph, self.drop_key, self.walk, self.reading)

    @cached_property
    def chain(self) -> Chain:
        """The walk on the augmented graph, which answers all further questions."""
        return Chain(self.augmented.weights, self.augmented.labels, self.augmented.start, self.augmented.goals)

    @property
    def exit_depth(self) -> int:
        """Number of goals (keys and doors) that must be achieved before the exit."""
        return self.graph.exit_depth

    @property
    def width(self) -> int:
        """Largest number of rooms at the same depth of the tree of keys."""
        return self.graph.width

    @property
    def nodes(self) -> int:
        """Number of nodes of the augmented graph."""
        return len(self.augmented.nodes)

    @property
    def edges(self) -> int:
        """Number of its moves, without restarts."""
        return len(self.augmented.edges)

    @property
    def hitting_time(self) -> float:
        """The paper's hitting time of the exit (Table 2): b' pinv(D - W) b, see `laplacian_hitting_time`."""
        return self.chain.hitting_time

    @property
    def expected_steps(self) -> float:
        """Mean number of steps until the exit is first reached, including steps that stay."""
        return self.chain.expected_steps

    @property
    def variance(self) -> float:
        """Variance of the number of steps until the exit is first reached."""
        return self.chain.variance

    @property
    def std(self) -> float:
        """Standard deviation of the number of steps until the exit is first reached."""
        return self.chain.std

    def reach_probability(self, t: ArrayLike, goal: str = "exit") -> NDArray[np.float64]:
        """See `Chain.reach_probability`."""
        return self.chain.reach_probability(t, goal)

    def expected_states(self, t: ArrayLike) -> NDArray[np.float64]:
        """See `Chain.expected_states`; of nodes that are alike only one is computed."""
        return expected_states(self.chain.weights, self.chain.source, t, *alike_nodes(self.augmented))

    def expected_steps_to(self, goal: str) -> float:
        """See `Chain.expected_steps_to`."""
        return self.chain.expected_steps_to(goal)

    def hitting_time_to(self, node: str) -> float:
        """See `Chain.hitting_time_to`."""
        return self.chain.hitting_time_to(node)

    def edge_sensitivity(self) -> list[EdgeSensitivity]:
        """See `Chain.edge_sensitivity`."""
        return self.chain.edge_sensitivity()

    def goal_sensitivity(self) -> dict[str, float]:
        """See `Chain.goal_sensitivity`."""
        return self.chain.goal_sensitivity()

    def described(self) -> dict[str, Any]:
        """Return what the report is of, as plain types."""
        return {
            "graph": self.graph.name,
            "key_rooms": {f"key {room}": home for room, home in enumerate(self.graph.key_rooms, start=1)},
            "exit_room": self.graph.exit_room,
            "drop_key": self.drop_key,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the whole report as plain numbers, strings, lists and dicts."""
        return {
            **self.described(),
            "walk": asdict(self.walk),
            "reading": asdict(self.reading),
            **{name: getattr(self, name) for name in NUMBERS},
            "reach_probability": by_time(self.reach_probability, REPORT_TIMES),
            "expected_states": by_time(self.expected_states, REPORT_TIMES),
            "expected_steps_to": {goal: self.expected_steps_to(goal) for goal in self.chain.goals},
            "goal_sensitivity": self.goal_sensitivity(),
        }

    @property
    def _head(self) -> str:
        drop = "with" if self.drop_key else "without"
        return f"goal graph {self.graph.name}, {self.graph.n_rooms} rooms, {drop} drop"

    def _lines(self) -> list[tuple[str, str]]:
        reached = ", ".join(f"{t}: {p:.3f}" for t, p in by_time(self.reach_probability, REPORT_TIMES).items())
        limit = f", saturates near {1 / self.walk.restart:.4g}" if self.walk.restart else ""
        lines = [
            ("key rooms", f"{list(self.graph.key_rooms)}, exit room {self.graph.exit_room}   (0 is the centre)"),
            ("exit depth", f"{self.exit_depth}"),
            ("width", f"{self.width}"),
            ("augmented graph", f"{self.nodes} nodes, {self.edges} edges"),
            ("hitting time", f"{self.hitting_time:.2f}   (the paper's Table 2: least squares{limit})"),
            ("expected steps", f"{self.expected_steps:.1f} +- {self.std:.1f}   (mean first passage of the same walk)"),
            ("exit reached by", reached),
        ]
        hardest = [f"{goal} {change:+.2f}%" for goal, change in self.goal_sensitivity().items()][:3]
        if hardest:
            lines.append(("hardest goals", f"{', '.join(hardest)}   (steps, if 1% easier)"))
        return lines

    def __str__(self) -> str:
        return "\n".join([self._head, *(f"  {name:<16}{value}" for name, value in self._lines())])

    def _repr_svg_(self) -> str:
        from hierroom.complexity.drawing.draw import svg_of  # matplotlib loads slowly, and few reports are drawn

        return svg_of(self.augmented)

    def _repr_html_(self) -> str:
        return html_table(self._head, (), self._lines())
