"""How hard a goal graph is to explore, computed before training."""

from __future__ import annotations

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
"""Numbers of steps at which `to_dict` and `str` evaluate the curves; an episode is truncated after 1000."""


def analyze(
    graph: GoalGraph | str | Path,
    drop_key: bool = False,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
) -> ComplexityReport:
    """Compute how hard a goal graph is to explore by the paper's random walk.

    Args:
        graph: a letter `"a"` to `"g"`, a name such as `"keys-0-1-exit-2"`, a `GoalGraph`, or a path to a TOML file.
        drop_key: whether keys can be dropped.
        walk: the probabilities of one step.
        reading: interpretation of the paper's augmented graph.

    Returns:
        A report that computes each quantity on first access.
    """
    return ComplexityReport(as_goal_graph(graph), bool(drop_key), walk, reading)


@dataclass(frozen=True)
class ComplexityReport:
    """Depth, width and passage times of a goal graph; created by `analyze`.

    Two numbers say how long it takes to reach the exit. `hitting_time` is the value in the paper's Table 2, the
    least-squares solution of its Laplacian system, which saturates near 1 / 0.01 = 100. `expected_steps` is the true
    mean number of steps of the same walk, which does not saturate.

    Args:
        graph: the goal graph.
        drop_key: whether keys can be dropped.
        walk: the probabilities of one step.
        reading: interpretation of the paper's augmented graph.
    """

    graph: GoalGraph
    drop_key: bool = False
    walk: Walk = PAPER_WALK
    reading: Reading = TABLE_READING

    def __post_init__(self) -> None:
        object.__setattr__(self, "_augmented", AugmentedGraph(self.graph, self.drop_key, self.walk, self.reading))

    @property
    def augmented(self) -> AugmentedGraph:
        """The goal graph unrolled over the sets of open doors."""
        return self.__dict__["_augmented"]

    @cached_property
    def chain(self) -> Chain:
        """The walk on the augmented graph, which answers all further questions."""
        unrolled = self.augmented
        return Chain(unrolled.weights, unrolled.labels, unrolled.start, unrolled.goals)

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
        """Number of moves between its nodes without restarts."""
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
        """Probability that a goal has been achieved within t steps; see `Chain.reach_probability`."""
        return self.chain.reach_probability(t, goal)

    def expected_states(self, t: ArrayLike) -> NDArray[np.float64]:
        """Expected number of distinct nodes visited within t steps, computed of one of the nodes that are alike."""
        return expected_states(self.chain.weights, self.chain.source, t, *alike_nodes(self.augmented))

    def expected_steps_to(self, goal: str) -> float:
        """Mean number of steps until any goal is first achieved; see `Chain.expected_steps_to`."""
        return self.chain.expected_steps_to(goal)

    def hitting_time_to(self, node: str) -> float:
        """The paper's hitting time of any single node; see `Chain.hitting_time_to`."""
        return self.chain.hitting_time_to(node)

    def edge_sensitivity(self) -> list[EdgeSensitivity]:
        """The effect of each edge on the time to the exit; see `Chain.edge_sensitivity`."""
        return self.chain.edge_sensitivity()

    def goal_sensitivity(self) -> dict[str, float]:
        """The effect of each goal on the time to the exit; see `Chain.goal_sensitivity`."""
        return self.chain.goal_sensitivity()

    def to_dict(self) -> dict[str, Any]:
        """The whole report as plain numbers, strings, lists and dicts."""
        return {
            "graph": self.graph.name,
            "key_rooms": {f"key {room}": home for room, home in enumerate(self.graph.key_rooms, start=1)},
            "exit_room": self.graph.exit_room,
            "drop_key": self.drop_key,
            "walk": asdict(self.walk),
            "reading": asdict(self.reading),
            "exit_depth": self.exit_depth,
            "width": self.width,
            "nodes": self.nodes,
            "edges": self.edges,
            "hitting_time": self.hitting_time,
            "expected_steps": self.expected_steps,
            "std": self.std,
            "reach_probability": dict(
                zip(map(str, REPORT_TIMES), self.reach_probability(REPORT_TIMES).tolist(), strict=True)
            ),
            "expected_states": dict(
                zip(map(str, REPORT_TIMES), self.expected_states(REPORT_TIMES).tolist(), strict=True)
            ),
            "expected_steps_to": {goal: self.expected_steps_to(goal) for goal in self.chain.goals},
            "goal_sensitivity": self.goal_sensitivity(),
        }

    @property
    def _limit(self) -> str:
        return f", saturates near {1 / self.walk.restart:.4g}" if self.walk.restart else ""

    @property
    def _head(self) -> str:
        drop = "with" if self.drop_key else "without"
        return f"goal graph {self.graph.name}, {self.graph.n_rooms} rooms, {drop} drop"

    def _lines(self) -> list[tuple[str, str]]:
        reached = ", ".join(
            f"{t}: {chance:.3f}" for t, chance in zip(REPORT_TIMES, self.reach_probability(REPORT_TIMES), strict=True)
        )
        lines = [
            ("key rooms", f"{list(self.graph.key_rooms)}, exit room {self.graph.exit_room}   (0 is the centre)"),
            ("exit depth", f"{self.exit_depth}"),
            ("width", f"{self.width}"),
            ("augmented graph", f"{self.nodes} nodes, {self.edges} edges"),
            ("hitting time", f"{self.hitting_time:.2f}   (the paper's Table 2: least squares{self._limit})"),
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
        """The goal graph and its augmented graph, for notebooks that ask for a picture; see `complexity.drawing`."""
        from hierroom.complexity.drawing.draw import svg_of  # matplotlib loads slowly, and few reports are drawn

        return svg_of(self.augmented)

    def _repr_html_(self) -> str:
        """What notebooks show."""
        return html_table(self._head, (), self._lines())
