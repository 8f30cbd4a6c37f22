"""Goal graphs: the room of each key, and the room of the exit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hierroom.goals.alternatives import read_name, toml_text
from hierroom.goals.rules import Rules
from hierroom.goals.tree import canonical_rooms, child_rooms
from hierroom.support.errors import InputError, require_number, shown
from hierroom.support.files import as_utf8, read_toml, write_atomically
from hierroom.support.output import said_when_slow

if TYPE_CHECKING:
    import networkx as nx

SET_KINDS = ("rooms", "hitting_time", "expected_steps")
"""The possible words before the colon in a text that means a set of graphs: see `hierroom.complexity.GraphSet`."""

_ROOM = r"(?:0|[1-9][0-9]{0,3})"
_DESCRIBED = re.compile(rf"keys-({_ROOM}(?:-{_ROOM})*)-exit-({_ROOM})")


@dataclass(frozen=True)
class GoalGraph:
    """A goal graph: the room of each key, and the room of the exit.

    Room 0 is the centre; room ``r`` in ``1..n_rooms - 1`` is a branch room behind a locked door in the centre's wall.

    Args:
        key_rooms: where the key of room 1, 2, ... is: a room from 0 to ``n_rooms - 1``. They form a tree rooted at 0.
        exit_room: the room of the exit, 1 to ``n_rooms - 1``.
        label: the graph's name in every output; None for a name made by `name`. Equality ignores it.

    Examples:
        >>> graph = hierroom.GoalGraph(key_rooms=(0, 1), exit_room=2)
        >>> graph.name, graph.exit_depth, graph.width
        ('c', 4, 1)
        >>> graph == hierroom.GoalGraph.named("c") == hierroom.GoalGraph((2, 0), exit_room=1).canonical()
        True
        >>> print(graph.to_toml("chain.toml"), end="")
        key_rooms = [0, 1]
        exit_room = 2
        >>> hierroom.GoalGraph.from_toml("chain.toml").to_dict()
        {'name': 'chain', 'key_rooms': [0, 1], 'exit_room': 2}
        >>> hierroom.GoalGraph.from_dict({"key_rooms": [0], "exit_room": 1}).rules().names
        ('key 1', 'door 1', 'exit')
        >>> sorted(graph.to_networkx().successors("door 1"))
        ['key 2']
    """

    key_rooms: tuple[int, ...]
    exit_room: int
    label: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "key_rooms", _integers("key_rooms", self.key_rooms))
        object.__setattr__(self, "exit_room", _integers("exit_room", (self.exit_room,))[0])
        if not self.key_rooms:
            raise InputError("a goal graph needs at least one locked room: key_rooms is empty")
        last = self.n_rooms - 1
        for room, key_room in enumerate(self.key_rooms, start=1):
            if not 0 <= key_room <= last:
                raise InputError(f"the key of room {room} must be in a room from 0 to {last}, not in {shown(key_room)}")
        if not 1 <= self.exit_room <= last:
            raise InputError(
                f"the exit must be in a room from 1 to {last}, behind a door, not in {shown(self.exit_room)}"
            )
        if None in (depths := self._depths):
            behind = f"the key of room {depths.index(None)} is behind a cycle: {list(self.key_rooms)}"
            raise InputError(f"key_rooms must form a tree rooted at room 0, but {behind}")
        if self.label is not None:
            read_name("the name of a goal graph", self.label)
            if is_graph_set(self.label):
                raise InputError(f"{self.label!r} means a set of goal graphs; give yours another name")
            if (named := _graph_named(self.label)) is not None and named.canonical() != self.canonical():
                raise InputError(f"{self.label} is the name of another goal graph; give yours another")

    @property
    def n_rooms(self) -> int:
        """Number of rooms, including the centre."""
        return len(self.key_rooms) + 1

    @property
    def n_goals(self) -> int:
        """Number of goals of the graph: a key and a door for each branch room, and the exit."""
        return 2 * len(self.key_rooms) + 1

    @property
    def depths(self) -> tuple[int, ...]:
        """Depth of each room in the tree of keys; the centre has depth 0."""
        return tuple(depth or 0 for depth in self._depths)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """For each room, the rooms that have their keys in it, ascending."""
        return child_rooms(self.key_rooms)

    @property
    def exit_depth(self) -> int:
        """Number of goals (keys and doors) to achieve before the exit: twice the depth of its room (Table 2)."""
        return 2 * self.depths[self.exit_room]

    @property
    def width(self) -> int:
        """Largest number of rooms at the same depth (Table 2)."""
        return int(np.bincount(self.depths).max())

    @cached_property
    def name(self) -> str:
        """The label, else the letter of an isomorphic graph in the paper's Table 1, else the key and exit rooms."""
        if self.label is not None:
            return self.label
        return _letters().get(self.canonical(), f"keys-{'-'.join(map(str, self.key_rooms))}-exit-{self.exit_room}")

    @cached_property
    def _depths(self) -> tuple[int | None, ...]:
        depths, order = {0: 0}, [0]
        for room in order:
            order += self.children[room]
            depths |= dict.fromkeys(self.children[room], depths[room] + 1)
        return tuple(map(depths.get, range(self.n_rooms)))

    def canonical(self) -> GoalGraph:
        """Return the graph without its label and with canonical room numbers, so that isomorphic graphs are equal."""
        return GoalGraph(*canonical_rooms(self.key_rooms, self.exit_room))

    def to_networkx(self) -> nx.DiGraph:
        """Return the paper's goal dependency graph: start, keys, doors and exit; an edge means 'makes possible'."""
        import networkx as nx  # loads slowly, and few programs need it

        graph = nx.DiGraph()
        graph.add_node("start", kind="start", room=0)
        for room, key_room in enumerate(self.key_rooms, start=1):
            graph.add_node(f"key {room}", kind="key", room=room)
            graph.add_node(f"door {room}", kind="door", room=room)
            nx.add_path(graph, (f"door {key_room}" if key_room else "start", f"key {room}", f"door {room}"))
        graph.add_node("exit", kind="exit", room=self.exit_room)
        graph.add_edge(f"door {self.exit_room}", "exit")
        return graph

    def rules(self) -> Rules:
        """Return the same dependencies as rules: a key takes the free hand, and its door gives it back.

        The rules ignore the agent's room, so their numbers differ from those of the augmented graph.
        """
        rules, start = {}, {"free hand": 1}
        for room, key_room in enumerate(self.key_rooms, start=1):
            way = {"uses": {"free hand": 1, f"key {room} in place": 1}, "gives": f"key {room}"}
            rules[f"key {room}"] = way if key_room == 0 else {"needs": f"door {key_room}", **way}
            rules[f"door {room}"] = {"uses": f"key {room}", "gives": [f"door {room}", "free hand"]}
            start[f"key {room} in place"] = 1
        rules["exit"] = {"needs": f"door {self.exit_room}", "gives": "exit"}
        return Rules(rules, "exit", start=start, label=self.name)

    def _repr_svg_(self) -> str | None:
        from hierroom.goals.drawing import svg_of  # matplotlib loads slowly, and few graphs are drawn

        return svg_of(self.to_networkx(), f"goal graph {self.name}")

    def to_dict(self) -> dict[str, Any]:
        """Return the graph as plain types: ``name``, ``key_rooms`` and ``exit_room``."""
        return {"name": self.name, "key_rooms": list(self.key_rooms), "exit_room": self.exit_room}

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> GoalGraph:
        """Return the graph of a table such as `to_dict` gives; its ``name`` may be missing or called ``label``."""
        entries = {*table} if isinstance(table, Mapping) else set()
        names = [*(entries & {"name", "label"})]  # Gymnasium's specs store a graph by the names of its fields
        if entries - {*names} != {"key_rooms", "exit_room"} or len(names) > 1:
            given = ", ".join(sorted(map(str, entries))) or "nothing"
            raise InputError(f"a goal graph has key_rooms, exit_room and perhaps a name; this has {given}")
        return cls(table["key_rooms"], table["exit_room"], table[names[0]] if names else None)

    def to_toml(self, path: str | Path | None = None) -> str:
        """Return the graph as TOML text, and write it to ``path`` if one is given."""
        name = "" if self.label is None else f"name = {toml_text(self.label)}\n"
        text = f"{name}key_rooms = {list(self.key_rooms)}\nexit_room = {self.exit_room}\n"
        if path is not None:
            write_atomically(path, text)
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> GoalGraph:
        """Read a graph as `to_toml` writes it; if there is no entry ``name``, its label is the file's name."""
        table = read_toml(path := Path(path), "goal graph")
        try:
            graph = cls.from_dict(table)
            if graph.label is not None:
                return graph
            named = as_utf8(path)
            try:
                return cls(graph.key_rooms, graph.exit_room, named.stem)
            except InputError:
                return cls(graph.key_rooms, graph.exit_room, named.name)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    @classmethod
    def named(cls, name: str) -> GoalGraph:
        """Return the graph of a letter ``"a"`` to ``"g"`` (the paper's Table 1), or of ``"keys-0-1-exit-2"``."""
        graph = _graph_named(name) if isinstance(name, str) else None
        if graph is None:
            raise InputError(f"name a goal graph by a letter from a to g, or like keys-0-1-exit-2, not {shown(name)}")
        return graph if name in NAMED_GRAPHS else cls(graph.key_rooms, graph.exit_room, name)


def enumerate_graphs(n_rooms: int) -> list[GoalGraph]:
    """List the goal graphs of 2 to 14 rooms, each once up to renaming: rooted trees with a marked exit room.

    Their numbers 1, 3, 9, 26, ..., 337,830 are coefficients of T^2 / (1 - T); T counts rooted trees (OEIS A000081).

    Examples:
        >>> [graph.name for graph in hierroom.enumerate_graphs(3)]
        ['b', 'keys-0-1-exit-1', 'c']
    """
    require_number("the number of rooms of goal graphs", n_rooms, 2, 14, is_whole=True)
    trees: set[tuple[int, ...]] = {()}
    with said_when_slow(f"listing the goal graphs of {n_rooms} rooms"):
        for size in range(1, n_rooms):
            trees = {canonical_rooms((*tree, parent), None)[0] for tree in trees for parent in range(size)}
        graphs = {canonical_rooms(tree, exit_room) for tree in trees for exit_room in range(1, n_rooms)}
        return [GoalGraph(*graph) for graph in sorted(graphs)]


def _integers(what: str, values: Any) -> tuple[int, ...]:
    try:
        rooms = tuple(values)
    except TypeError:  # also for an array without axes, although that is an Iterable
        rooms = None
    if rooms is None or isinstance(values, str):
        raise InputError(f"{what} takes a list of whole numbers (rooms), not {shown(values)}")
    if not all(isinstance(v, (int, np.integer)) and not isinstance(v, bool) for v in rooms):
        raise InputError(f"{what} takes whole numbers (rooms), not {', '.join(map(shown, rooms[:9]))}")
    return tuple(int(v) for v in rooms)


NAMED_GRAPHS = {
    "a": GoalGraph((0,), 1),
    "b": GoalGraph((0, 0), 1),
    "c": GoalGraph((0, 1), 2),
    "d": GoalGraph((0, 0, 1), 2),
    "e": GoalGraph((0, 0, 0), 3),
    "f": GoalGraph((0, 0, 1), 3),
    "g": GoalGraph((0, 1, 2), 3),
}
"""The goal graphs of the paper's Table 1."""


@cache
def _letters() -> Mapping[GoalGraph, str]:
    return {graph.canonical(): letter for letter, graph in NAMED_GRAPHS.items()}


def _graph_named(name: str) -> GoalGraph | None:
    rooms = _DESCRIBED.fullmatch(name)
    described = rooms and GoalGraph(tuple(map(int, rooms[1].split("-"))), int(rooms[2]))
    return NAMED_GRAPHS.get(name, described)


def is_graph_name(name: str) -> bool:
    """Return whether a text names one goal graph, as in `GoalGraph.named`."""
    return name in NAMED_GRAPHS or _DESCRIBED.fullmatch(name) is not None


def is_graph_set(spec: object) -> bool:
    """Return whether a text means a set of graphs, even a malformed one, and not one graph."""
    return isinstance(spec, str) and spec.partition(":")[0].strip() in SET_KINDS
