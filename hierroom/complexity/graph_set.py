"""Sets of goal graphs, given by name, file, number of rooms or difficulty, and a curriculum over such a set."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from functools import cached_property, lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.report import analyze
from hierroom.goals import (
    MAX_GRID_ROOMS,
    GoalGraph,
    GraphSpecs,
    as_goal_graph,
    enumerate_graphs,
    graph_specs,
    is_graph_set,
    spec_names,
)
from hierroom.support.errors import InputError, require_number
from hierroom.support.output import said_in_turn

_INTERVAL = re.compile(r"(hitting_time|expected_steps):(\d+(?:\.\d+)?)\.\.(\d+(?:\.\d+)?)", re.ASCII)
_Assumed: TypeAlias = tuple[bool, Walk]
"""Assumptions of `analyze`: whether keys can be dropped, and the walk."""
_ROOMS = re.compile(r"rooms:(\d{1,4})", re.ASCII)


class GraphSet:
    """A set of different goal graphs. Graphs that differ only in the numbers of their rooms count as the same graph.

    Args:
        specs: one or several (list or tuple) of: a letter, a name such as ``keys-0-1-exit-2``, a `GoalGraph`, a path to
            a TOML file, or ``rooms:N`` for every goal graph of N rooms. ``hitting_time:LOW..HIGH`` or
            ``expected_steps:LOW..HIGH`` means every goal graph of up to 7 rooms in this range. The hitting time
            saturates near 100 and does not separate the hardest graphs; the expected steps do.
        exclude: graphs to leave out, in the same forms; the numbers of their rooms do not matter.
        max_rooms: largest N of ``rooms:N``; by default the most rooms that a grid can hold.
        walk: the random walk that determines difficulties.

    Attributes:
        graphs: the graphs in the order of the specs, with their given names; in an interval, the easiest come first.
        excluded: the graphs that are left out, in the same order.
        alike: pairs of names of equal graphs: one that was given again, and the earlier one, which is kept.
        repeated: names of graphs and sets that were given again under the same name.

    Examples:
        >>> graphs = hierroom.complexity.GraphSet(["a", "rooms:3"], exclude="c")
        >>> [graph.name for graph in graphs.graphs]
        ['a', 'b', 'keys-0-1-exit-1']
    """

    def __init__(
        self,
        specs: GraphSpecs,
        exclude: GraphSpecs = (),
        drop_key: bool = False,
        max_rooms: int = MAX_GRID_ROOMS,
        walk: Walk = PAPER_WALK,
    ):
        self.specs = graph_specs(specs)
        if not self.specs:
            raise InputError("give at least one goal graph, or a set of them such as rooms:4")
        self._assumed, self._max_rooms = (bool(drop_key), walk), max_rooms
        own: dict[GoalGraph, GoalGraph] = {}
        named = [as_goal_graph(spec) for spec in self.specs if not is_graph_set(spec)]
        pairs = [(graph.name, own.setdefault(graph.canonical(), graph).name) for graph in named]
        self.repeated = tuple(name for name, count in Counter(spec_names(self.specs)).items() if count > 1)
        self.alike = tuple(dict.fromkeys((name, kept) for name, kept in pairs if name != kept))
        given = [graph.canonical() for spec in self.specs for graph in self._graphs_of(spec)]
        chosen = {canonical: own.get(canonical, canonical) for canonical in given}
        left_out: set[GoalGraph] = set()
        for spec in graph_specs(exclude):
            unwanted = {graph.canonical() for graph in self._graphs_of(spec)}
            if unwanted.isdisjoint(chosen):
                (name,), several = spec_names(spec), is_graph_set(spec)
                raise InputError(
                    f"cannot exclude {name}: {'none of its graphs' if several else 'it'} is "
                    f"{'' if several else 'not '}among the goal graphs of {' and '.join(spec_names(self.specs))}"
                )
            left_out |= unwanted
        self.graphs = tuple(graph for canonical, graph in chosen.items() if canonical not in left_out)
        self.excluded = tuple(graph for canonical, graph in chosen.items() if canonical in left_out)
        if not self.graphs:
            raise InputError(f"no goal graph is left of {' and '.join(spec_names(self.specs))}: all are excluded")
        for name, count in Counter(graph.name for graph in chosen.values()).items():
            if count > 1:
                raise InputError(
                    f"two different goal graphs are named {name}; name one of them otherwise, by an entry like "
                    f'name = "{name}-2" in its file'
                )

    @property
    def notes(self) -> list[str]:
        """A line of text for each pair of `alike`, and for each of `repeated`."""
        return [
            f"goal graphs {kept} and {name} are the same, but for names and the numbers of rooms, and are taken once"
            for name, kept in self.alike
        ] + [f"{name} is given twice among the goal graphs, and is taken once" for name in self.repeated]

    @cached_property
    def difficulties(self) -> tuple[tuple[float, GoalGraph], ...]:
        """Each graph after its difficulty, the easiest first: the quantity of an interval, else the expected steps."""
        return _ranked(self.graphs, self._interval.quantity if self._interval else "expected_steps", self._assumed)

    def stages(self, n_stages: int) -> tuple[tuple[GoalGraph, ...], ...]:
        """Divide the set, the easiest graphs first, into parts of equal width in difficulty; drop empty parts."""
        if len(self.graphs) == 1:
            return (self.graphs,)  # the augmented graph may be too large to compute a difficulty
        values = np.array([value for value, _ in self.difficulties])
        low, high = (self._interval.low, self._interval.high) if self._interval else (values[0], values[-1])
        stage_of = np.searchsorted(np.linspace(low, high, n_stages + 1)[1:-1], values, side="right")
        return tuple(
            tuple(graph for (_, graph), its in zip(self.difficulties, stage_of, strict=True) if its == stage)
            for stage in np.unique(stage_of)
        )

    @cached_property
    def _interval(self) -> _Interval | None:
        spec = self.specs[0]
        return _interval_of(spec) if len(self.specs) == 1 and isinstance(spec, str) else None

    def _graphs_of(self, spec: GoalGraph | str) -> Iterable[GoalGraph]:
        if not isinstance(spec, str) or not is_graph_set(spec):
            return [as_goal_graph(spec)]
        interval, rooms = _interval_of(spec), _ROOMS.fullmatch(spec.strip())
        if interval is not None:
            return _graphs_between(interval, self._assumed)
        if rooms is None:
            raise InputError(
                "a set of goal graphs must be rooms:N, hitting_time:LOW..HIGH or expected_steps:LOW..HIGH, "
                f"not {spec!r}"
            )
        n_rooms = int(rooms[1])
        if not 2 <= n_rooms <= self._max_rooms:
            raise InputError(f"rooms:N takes a number of rooms from 2 to {self._max_rooms}, not {n_rooms}")
        return enumerate_graphs(n_rooms)


class Curriculum:
    """A curriculum over a set of goal graphs, controlled by the agent's success rate; the caller stores the stage.

    Args:
        n_stages: number of parts into which the set is divided, at least 1; see `GraphSet.stages`.
        promote_at: the next stage begins at this success rate or above.
        demote_at: the previous stage returns below this success rate; 0 <= demote_at < promote_at <= 1.

    Examples:
        >>> curriculum = hierroom.complexity.Curriculum(hierroom.complexity.GraphSet("rooms:3"), n_stages=2)
        >>> curriculum.advance(0, 0.9), curriculum.advance(1, 0.1)
        (1, 0)
    """

    def __init__(self, graphs: GraphSet, n_stages: int = 5, promote_at: float = 0.8, demote_at: float = 0.2):
        require_number("the number of stages", n_stages, 1, is_whole=True)
        if not 0 <= demote_at < promote_at <= 1:
            raise InputError(
                "a curriculum needs 0 <= demote_at < promote_at <= 1, "
                f"not demote_at {demote_at:g} and promote_at {promote_at:g}"
            )
        self.stages: tuple[tuple[GoalGraph, ...], ...] = graphs.stages(n_stages)
        self._promote_at, self._demote_at = promote_at, demote_at

    def advance(self, stage: int, success_rate: float) -> int:
        """Return the next, the same or the previous stage, given the success rate (0..1) of recent episodes."""
        last = len(self.stages) - 1
        if not 0 <= stage <= last:
            raise InputError(f"the stages are 0 to {last}; there is no stage {stage}")
        if not 0 <= success_rate <= 1:
            raise InputError(f"a success rate must be in 0..1, not {success_rate:g}")
        step = int(success_rate >= self._promote_at) - int(success_rate < self._demote_at)
        return min(max(stage + step, 0), last)


def find_graphs(specs: GraphSpecs, exclude: GraphSpecs, drop_key: bool) -> GraphSet:
    """Return a `GraphSet` with the paper's walk; results are cached."""
    given = graph_specs(specs), graph_specs(exclude)
    # part of the cache's key, because graphs that differ only in their labels are equal
    labels = tuple(spec.label for spec in sum(given, ()) if isinstance(spec, GoalGraph))
    return _found(*given, bool(drop_key), labels)


_found = lru_cache(lambda specs, exclude, drop_key, labels: GraphSet(specs, exclude, drop_key))


class _Interval(NamedTuple):
    quantity: str
    low: float
    high: float


def _interval_of(spec: str) -> _Interval | None:
    match = _INTERVAL.fullmatch(spec.strip())
    return None if match is None else _Interval(match[1], float(match[2]), float(match[3]))


def _graphs_between(interval: _Interval, assumed: _Assumed) -> tuple[GoalGraph, ...]:
    quantity, low, high = interval
    if low > high:
        raise InputError(f"an interval must go from low to high, not from {low:g} to {high:g}")
    ranked = _ranked([graph for n in range(2, MAX_GRID_ROOMS + 1) for graph in enumerate_graphs(n)], quantity, assumed)
    graphs = tuple(graph for value, graph in ranked if low <= value <= high)
    if not graphs:
        raise InputError(
            f"no goal graph of up to {MAX_GRID_ROOMS} rooms has {quantity} in {low:g}..{high:g}; "
            f"the values go from {ranked[0][0]:.2f} to {ranked[-1][0]:.2f}"
        )
    return graphs


def _ranked(graphs: Iterable[GoalGraph], quantity: str, assumed: _Assumed) -> tuple[tuple[float, GoalGraph], ...]:
    several = [*graphs]
    work = f"measuring {len(several)} goal graphs"
    ranked = [(_difficulty(graph, quantity, assumed), graph) for graph in said_in_turn(work, several)]
    return tuple(sorted(ranked, key=lambda pair: (pair[0], pair[1].key_rooms, pair[1].exit_room)))


_difficulty = lru_cache(2048)(lambda graph, quantity, assumed: float(getattr(analyze(graph, *assumed), quantity)))
