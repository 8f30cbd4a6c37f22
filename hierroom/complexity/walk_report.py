"""The part of a report that describes its walk, whatever its nodes are."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.chains.walk import Walk
from hierroom.support.output import said_in_turn
from hierroom.support.tables import html_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


REPORT_TIMES = (10, 100, 1000)
"""Numbers of steps at which reports evaluate the curves; an episode is truncated after 1000."""
NUMBERS = ("exit_depth", "width", "nodes", "edges", "hitting_time", "expected_steps", "std")
MAX_COUNTED_NODES = 1000
"""With more nodes, `to_dict` leaves out the expected states, which take a computation for each node."""


def by_time(curve: Callable[[ArrayLike], NDArray[np.float64]]) -> dict[str, float]:
    """Return the values of a curve at `REPORT_TIMES`, each under its time as text."""
    return dict(zip(map(str, REPORT_TIMES), curve(REPORT_TIMES).tolist(), strict=True))


def short(number: float, digits: int = 1) -> str:
    """Return a number with some decimals, or with four significant digits from 10^7 on."""
    return f"{number:.4g}" if math.isfinite(number) and abs(number) >= 1e7 else f"{number:.{digits}f}"


class WalkReport(ABC):
    """A report on the walk of `chain`: passage times, reach and sensitivity, as text, HTML, SVG and plain types.

    Two numbers say how long it takes to reach the exit. `hitting_time` is the paper's (Table 2), the least-squares
    solution of its Laplacian system, which saturates near 1 / 0.01 = 100. `expected_steps` is the true mean number of
    steps of the same walk, which does not saturate.
    """

    walk: Walk
    chain: Chain
    exit_depth: float
    width: int

    @property
    @abstractmethod
    def name(self) -> str:
        """A short name of the report's subject."""

    @abstractmethod
    def described(self) -> dict[str, Any]:
        """Return a description of the subject, as plain types."""

    @property
    @abstractmethod
    def edges(self) -> int:
        """Number of moves, without restarts."""

    _reached_by = "exit reached by"

    @property
    @abstractmethod
    def _head(self) -> str: ...

    @abstractmethod
    def _first_lines(self) -> list[tuple[str, str]]: ...

    @property
    def nodes(self) -> int:
        """Number of nodes of the walk."""
        return len(self.chain.labels)

    @property
    def hitting_time(self) -> float:
        """The paper's hitting time of the exit (Table 2): b' pinv(D - W) b, see `laplacian_hitting_time`.

        ``inf`` if the exit is out of reach, ``nan`` if the walk may never return to the start: see `Chain.is_one_way`.
        """
        return self.chain.hitting_time

    @property
    def expected_steps(self) -> float:
        """Mean number of steps until the exit is first reached, including steps that stay."""
        return self.chain.expected_steps

    @property
    def std(self) -> float:
        """Standard deviation of the number of steps until the exit is first reached."""
        return self.chain.std

    def reach_probability(self, t: ArrayLike, goal: str = EXIT) -> NDArray[np.float64]:
        """See `Chain.reach_probability`."""
        return self.chain.reach_probability(t, goal)

    def expected_states(self, t: ArrayLike) -> NDArray[np.float64]:
        """See `Chain.expected_states`."""
        return self.chain.expected_states(t)

    def expected_steps_to(self, goal: str) -> float:
        """See `Chain.expected_steps_to`."""
        return self.chain.expected_steps_to(goal)

    def goal_sensitivity(self) -> dict[str, float]:
        """See `Chain.goal_sensitivity`."""
        return self.chain.goal_sensitivity()

    @property
    def _are_states_counted(self) -> bool:
        return self.nodes <= MAX_COUNTED_NODES

    def to_dict(self) -> dict[str, Any]:
        """Return the whole report as plain numbers, strings, lists and dicts."""
        return {
            **self.described(),
            "walk": asdict(self.walk),
            **{name: getattr(self, name) for name in NUMBERS},
            "reach_probability": by_time(self.reach_probability),
            "expected_states": by_time(self.expected_states) if self._are_states_counted else None,
            "expected_steps_to": {
                goal: self.expected_steps_to(goal)
                for goal in said_in_turn(f"measuring the steps to {len(self.chain.goals):,} goals", [*self.chain.goals])
            },
            "goal_sensitivity": self.goal_sensitivity(),
        }

    def _lines(self) -> list[tuple[str, str]]:
        restart = self.walk.restart
        source = f"the paper's Table 2: least squares{f', saturates near {1 / restart:.4g}' if restart else ''}"
        if math.isnan(self.hitting_time):
            source = "it needs a walk that returns to the start from wherever it goes"
        reached = ", ".join(f"{t}: {p:.3f}" for t, p in by_time(self.reach_probability).items())
        steps = f"{short(self.expected_steps)} +- {short(self.std)}"
        lines = [
            *self._first_lines(),
            ("hitting time", f"{self.hitting_time:.2f}   ({source})"),
            ("expected steps", f"{steps}   (mean first passage of the same walk)"),
            (self._reached_by, reached),
        ]
        hardest = [f"{goal} {change:+.2f}%" for goal, change in self.goal_sensitivity().items()][:3]
        if hardest:
            lines.append(("hardest goals", f"{', '.join(hardest)}   (steps, if 1% easier)"))
        return lines

    @abstractmethod
    def _figure(self) -> Figure: ...

    def draw(self, path: str | Path) -> None:
        """Draw the graph or rules and the walk into a .png (the default), .pdf or .svg file."""
        from hierroom.support.sheet import save_figure  # matplotlib loads slowly, and few reports are drawn

        save_figure(self._figure(), path)

    def _repr_svg_(self) -> str:
        from hierroom.support.sheet import picture_of

        return picture_of(self._figure(), "svg").decode()

    def __str__(self) -> str:
        return "\n".join([self._head, *(f"  {name:<16}{value}" for name, value in self._lines())])

    def _repr_html_(self) -> str:
        return html_table(self._head, (), self._lines())
