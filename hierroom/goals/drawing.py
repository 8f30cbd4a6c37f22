"""The picture of a goal graph: each key, door and the exit below what makes it possible."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hierroom.support.sheet import EXIT_COLOUR, INK, Sheet, colour_of, picture_of

if TYPE_CHECKING:
    import networkx as nx

MOST_GOALS = 200
"""The most nodes of a graph that a notebook draws, in a second or two."""


def draw_goals(sheet: Sheet, goals: nx.DiGraph, title: str) -> Sheet:
    """Draw a goal graph, given as `GoalGraph.to_networkx` returns it, and return the sheet."""
    number, depths = {name: n for n, name in enumerate(goals)}, {"start": 0}
    for above, below in goals.edges:  # a room's key comes before those that it holds
        depths[below] = depths[above] + 1
    colours = [EXIT_COLOUR if name == "exit" else colour_of(goals.nodes[name]["room"]) for name in goals]
    edges = {(number[above], number[below]): EXIT_COLOUR if below == "exit" else INK for above, below in goals.edges}
    sheet.boxes(title, [*number], [depths[name] for name in number], colours, edges)
    return sheet


def svg_of(goals: nx.DiGraph, title: str) -> str | None:
    """Return the picture of a goal graph as SVG, for notebooks; None if it is too large."""
    if len(goals) > MOST_GOALS:
        return None
    return picture_of(draw_goals(Sheet(), goals, title).finish([]), "svg").decode()
