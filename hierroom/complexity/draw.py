"""Drawings of goal graphs, next to their augmented graphs if these can be read, and of the goals of rules.

An augmented graph has a box for each set of open doors, in rows by their number, as in the paper's appendix. The exit
is drawn in each set of open doors from which it can be reached, so that no arrow crosses the picture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import networkx as nx
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph, Node
from hierroom.complexity.requirements import goal_depths, links
from hierroom.goals import Rules
from hierroom.goals.drawing import draw_goals
from hierroom.support.layers import Point, place_layers
from hierroom.support.pictures import drawing
from hierroom.support.sheet import EXIT_COLOUR, FAINT, INK, PALE, USED_COLOUR, Sheet, colour_of

MOST_NODES, MOST_POINTS = 250, 1250.0
"""The most nodes, and the largest size, of an augmented graph that is drawn."""
NODE, STEP, ROOMS, KEYS, HEIGHT, BAND = (32.0, 20.0), 42.0, 32.0, 76.0, 94.0, 6.0
"""In points: size of a node, distance of neighbours, heights of the rooms and keys in a box, its height, and the width
of a band around its rooms."""

Doors = tuple[int, ...]


def figure_of_graph(augmented: AugmentedGraph) -> Figure:
    """Return the figure of a goal graph, next to its augmented graph if that can be read."""
    graph, n = augmented.graph, len(augmented.nodes)
    title = f"goal graph {graph.name}\n{graph.n_rooms} rooms, exit depth {graph.exit_depth}, width {graph.width}"
    sheet = draw_goals(Sheet(), graph.to_networkx(), title)
    is_drawn = n <= MOST_NODES and draw_augmented(sheet, augmented, MOST_POINTS)
    return sheet.finish(notes_of_augmented(augmented) if is_drawn else [f"not drawn: the augmented graph, {n:,} nodes"])


def draw_augmented(sheet: Sheet, augmented: AugmentedGraph, most: float) -> bool:
    """Draw an augmented graph unless it is wider or higher than ``most``; return whether it is drawn."""
    number = {doors: n for n, doors in enumerate(augmented.levels)}
    edges = [(number[doors], number[after]) for doors in number for after in _openings(augmented, doors).values()]
    layout = place_layers([_size(augmented, doors) for doors in number], [*map(len, number)], edges, is_down=True)
    if max(layout.size) > most:
        return False
    drop = "with" if augmented.drop_key else "without"
    counts = f"{len(augmented.nodes)} nodes, {len(augmented.edges)} edges"
    sheet.begin(f"augmented graph, {drop} drop\n{counts}", layout.size)
    centres, at = dict(zip(number, layout.places, strict=True)), {}
    for doors in centres:
        at |= _draw_doors(sheet, augmented, doors, centres)
    for doors in centres:
        for key, after in _openings(augmented, doors).items():
            _draw_move(sheet, at[Node("key", key, doors)], at[Node("room", key, after)], colour_of(key))
    for node, place in at.items():
        names = {"key": f"k{node.room}", "exit": "exit", "room": f"r{node.room}" if node.room else "start"}
        colour = EXIT_COLOUR if node.kind == "exit" else colour_of(node.room)
        sheet.box(place, NODE, names[node.kind], colour, **{"boxstyle": "square,pad=0"} if node.kind == "key" else {})
    return True


def notes_of_augmented(augmented: AugmentedGraph) -> list[str]:
    """Return the lines that explain the symbols of `draw_augmented` and name what is not drawn."""
    walk = augmented.walk
    return [
        "round: rooms; square: keys, k1 opens room 1; exit: one node, drawn wherever it is reached",
        "grey band: its rooms lead to each other; grey arrow: from each of them",
        *["second head of a grey arrow: back to each of them, as a key is dropped"] * augmented.drop_key,
        f"not drawn: staying ({walk.stay:g}), and the restart from every node to the start ({walk.restart:g})",
    ]


def _draw_doors(
    sheet: Sheet, augmented: AugmentedGraph, doors: Doors, centres: Mapping[Doors, Point]
) -> dict[Node, Point]:
    """Draw the box of a set of open doors and the moves within it, and return the places of its nodes."""
    (x, y), whole, openings = centres[doors], _size(augmented, doors), _openings(augmented, doors)
    top, last = y - HEIGHT / 2, augmented.graph.exit_room
    rooms = [Node("room", room, doors) for room in sorted((0, *doors), key=lambda room: (room == last, room))]
    keys = [Node("key", key, doors) for key in sorted(openings, key=lambda key: centres[openings[key]])]
    exits = [Node("exit", last, doors)] * (last in doors)
    aside = STEP * max(0, len(rooms) - len(keys) - 1) / 2 * len(exits)  # so that the exit is below its room
    at = {node: (x + STEP * (n - (len(rooms) - 1) / 2), top + ROOMS) for n, node in enumerate(rooms)}
    half = (len(keys) + len(exits) - 1) / 2
    at |= {node: (x + aside + STEP * (n - half), top + KEYS) for n, node in enumerate((*keys, *exits))}
    sheet.box((x, y), whole, "", "#f6f6f6", "#cccccc", zorder=0)
    is_all = len(doors) == augmented.graph.n_rooms - 1
    name = "all open" if is_all else f"open: {', '.join(map(str, doors))}" if doors else "all closed"
    sheet.write((x - whole[0] / 2 + BAND, top + 3), name)
    if len(rooms) > 1:
        sheet.box((x, top + ROOMS), (STEP * len(rooms) + 2, NODE[1] + 2 * BAND), "", "#e3e3e3", FAINT, zorder=1)
    for node in exits:
        _draw_move(sheet, at[rooms[-1]], at[node], EXIT_COLOUR)
    side, heads = STEP * len(rooms) / 2 - BAND, "<|-|>" if augmented.drop_key else "-|>"
    for key in keys:  # straight down from the band, where there is one
        start = (float(np.clip(at[key][0], x - side, x + side)), top + ROOMS + BAND) if doors else at[rooms[0]]
        _draw_move(sheet, start, at[key], FAINT, heads, 1.1)
    return at


def _openings(augmented: AugmentedGraph, doors: Doors) -> dict[int, Doors]:
    return {key: tuple(sorted((*doors, key))) for key in augmented.keys_in_reach(doors)}


def _size(augmented: AugmentedGraph, doors: Doors) -> Point:
    n_below = len(augmented.keys_in_reach(doors)) + (augmented.graph.exit_room in doors)
    return STEP * max(1 + len(doors), n_below, 2) + 2 * BAND, HEIGHT


def _draw_move(sheet: Sheet, start: Point, end: Point, colour: str, heads: str = "-|>", width: float = 1.8) -> None:
    (x, y), (to_x, to_y), half = start, end, NODE[1] / 2
    sheet.arrow([(x, y + half), (x, y + half + 2), (to_x, to_y - half - 6), (to_x, to_y - half)], colour, heads, width)


def figure_of_rules(rules: Rules) -> Figure:
    """Return the figure of the goals of rules."""
    sheet = Sheet()
    return sheet.finish(draw_rules(sheet, rules))


def draw_rules(
    sheet: Sheet, rules: Rules, names: Sequence[str] = (), colours: Sequence[str] = (), rims: Sequence[str] = ()
) -> list[str]:
    """Draw the goals of rules, each with an arrow from those that give what it requires, and return notes.

    Without alternatives, needs that follow from others are not drawn.
    """
    found, ways = links(rules), [way for ways in rules.rules.values() for way in ways]
    facts, graph = [fact for way in ways for fact in way.gives], nx.DiGraph([link[:2] for link in found])
    drawn = {(i, j): USED_COLOUR if is_used else INK for i, j, is_used in found}
    if len(ways) == len(rules.names) and len({*facts}) == len(facts) and nx.is_directed_acyclic_graph(graph):
        direct = nx.transitive_reduction(graph).edges
        drawn = {link: colour for link, colour in drawn.items() if colour == USED_COLOUR or link in direct}
    is_last = [any(rules.target in way.gives for way in ways) for ways in rules.rules.values()]
    colours = colours or [EXIT_COLOUR if last else PALE for last in is_last]
    title = f"{rules.name}\ntarget {rules.target}"
    sheet.boxes(title, names or rules.names, [*goal_depths(rules).values()], colours, drawn, rims)
    notes = ["red arrows: what is used up"] * (USED_COLOUR in drawn.values())
    return [*notes, *["not drawn: needs that follow from others"] * (len(drawn) < len(found))]


DONE, PAPER, PURSUED = "#bfe5c8", "#ffffff", "#f28e2b"


@lru_cache(maxsize=256)
def rules_picture(
    rules: Rules, achieved: frozenset[str], marking: tuple[int, ...], goal: str | None
) -> NDArray[np.uint8]:
    """Draw rules and their state: [H, W, 3] uint8. All pictures of the same rules have the same size.

    Arrows lead from a goal to the goals that require what it gives. Numbers count the facts that the goals give.
    """
    after, applies = rules.apply_all(marking)
    can_be_done = (applies & (after != np.array(marking)).any(axis=-1)).tolist()
    counts = [
        max(marking[rules.facts.index(fact)] for way in ways for fact in way.gives or (rules.target,))
        for ways in rules.rules.values()
    ]
    digits = len(str(max(rules.capacity.values())))
    names = [f"{name} {count:{digits}}" for name, count in zip(rules.names, counts, strict=True)]
    colours = [DONE if name in achieved else PAPER for name in rules.names]
    within_reach = [INK if is_possible else FAINT for is_possible in can_be_done]
    rims = [PURSUED if name == goal else rim for name, rim in zip(rules.names, within_reach, strict=True)]
    sheet = Sheet()
    notes = draw_rules(sheet, rules, names, colours, rims)
    canvas = FigureCanvasAgg(sheet.finish([*notes, "filled: achieved; orange: the subgoal", "dark rim: can be done"]))
    with drawing():
        canvas.draw()
    picture = np.array(canvas.buffer_rgba())[:, :, :3]
    picture.setflags(write=False)
    return picture
