"""Drawings of augmented graphs: a box for each set of open doors, in rows by their number, as in the paper's appendix.

The exit is drawn in each set of open doors from which it can be reached, so that no arrow crosses the picture.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hierroom.complexity.augmented import AugmentedGraph, Node
from hierroom.support.layers import Point, place_layers
from hierroom.support.sheet import EXIT_COLOUR, FAINT, Sheet, colour_of

NODE, STEP, ROOMS, KEYS, HEIGHT, BAND = (32.0, 20.0), 42.0, 32.0, 76.0, 94.0, 6.0
"""In points: size of a node, distance of neighbours, heights of the rooms and keys in a box, its height, and the width
of a band around its rooms."""

Doors = tuple[int, ...]


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
