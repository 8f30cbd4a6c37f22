"""A goal graph as a small picture for notebooks: the tree of its rooms."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from hierroom.goals.tree import child_rooms

COLUMN, ROW, RADIUS, TOP = 78, 74, 17, 48
"""In pixels: distance of neighbouring rooms, distance of depths, radius of a room, and height of the title."""
INK, PAPER, START, EXIT = "#333333", "#ffffff", "#d9d9d9", "#35a853"


def tree_svg(key_rooms: Sequence[int], exit_room: int, title: str) -> str:
    """Return an SVG document with each room below the room that holds its key; the exit's room has a second ring."""
    places = tree_places(key_rooms)
    width = max(int(COLUMN * (1 + max(column for column, _ in places))), 8 * len(title) + 20)
    height = TOP + ROW * max(depth for _, depth in places) + 2 * RADIUS + 24
    centres = [(COLUMN * (column + 0.5), TOP + RADIUS + ROW * depth) for column, depth in places]
    lines, rooms = [], []
    for room, (x, y) in enumerate(centres):
        if room:
            above, over = centres[key_rooms[room - 1]]
            lines.append(f'<line x1="{above:g}" y1="{over:g}" x2="{x:g}" y2="{y:g}" stroke="{INK}"/>')
            lines.append(_text((above + x) / 2, (over + y) / 2 + 4, f"key {room}", 11, behind=PAPER))
        fill = PAPER if room else START
        rooms.append(f'<circle cx="{x:g}" cy="{y:g}" r="{RADIUS}" fill="{fill}" stroke="{INK}"/>')
        rooms.append(_text(x, y + 5, str(room), 14))
        if room == exit_room:
            ring = f'r="{RADIUS + 4}" fill="none" stroke="{EXIT}" stroke-width="3"'
            rooms.append(f'<circle cx="{x:g}" cy="{y:g}" {ring}/>')
            rooms.append(_text(x, y + RADIUS + 19, "exit", 12, colour=EXIT))
    head = f'<text x="10" y="24" font-size="14" fill="{INK}">{escape(title)}</text>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'font-family="sans-serif"><rect width="100%" height="100%" fill="{PAPER}"/>'
        f"{head}{''.join(lines)}{''.join(rooms)}</svg>"
    )


def _text(x: float, y: float, words: str, size: int, colour: str = INK, behind: str = "none") -> str:
    halo = f'stroke="{behind}" stroke-width="5" paint-order="stroke"'
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="middle" fill="{colour}" {halo}>{words}</text>'


def tree_places(key_rooms: Sequence[int]) -> list[tuple[float, int]]:
    """Return (column, depth) of each room: leaves side by side, others in the middle above their children."""
    below = child_rooms(key_rooms)
    order, depths, waiting = [], [0] * len(below), [0]  # order: each room before its children, from left to right
    while waiting:
        order.append(room := waiting.pop())
        for child in below[room]:
            depths[child] = depths[room] + 1
        waiting += below[room][::-1]
    columns, n_leaves = [0.0] * len(below), 0
    for room in order:
        if not below[room]:
            columns[room], n_leaves = float(n_leaves), n_leaves + 1
    for room in reversed(order):
        if below[room]:
            columns[room] = (columns[below[room][0]] + columns[below[room][-1]]) / 2
    return list(zip(columns, depths, strict=True))
