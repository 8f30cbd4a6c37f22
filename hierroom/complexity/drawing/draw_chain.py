"""Drawings of rules and of chains: nodes in rows by their distance from the start."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.chains.weights import as_moves
from hierroom.complexity.drawing.draw import (
    EXIT_COLOUR,
    FAINT,
    INK,
    ROOM_COLOURS,
    Pen,
    figure_for,
    fold,
)
from hierroom.complexity.drawing.drawn_places import COLUMN, MAX_DRAWN_NODES, TEXT_LINE, Point, place_rows
from hierroom.complexity.markings import MarkingGraph
from hierroom.complexity.requirements import goal_depths, links
from hierroom.goals import Rules
from hierroom.support.errors import InputError

DEAD_COLOUR, USED_COLOUR = "#e15759", "#e15759"
LABEL_SIZE = 7.0
"""Size of labels in points; at scale 1 they are at most `COLUMN` wide."""


def figure_of_chain(chain: Chain, unrolled: MarkingGraph | None = None, *, restart: float) -> Figure:
    """Return the figure of a chain; a marking chain is drawn next to the goals of its rules.

    Args:
        chain: the chain.
        unrolled: the unrolled rules, if this is their marking chain.
        restart: probability of a restart; moves to the start that are no more probable are not drawn.
    """
    n = len(chain.labels)
    if n > MAX_DRAWN_NODES:
        raise InputError(f"a drawing can show at most {MAX_DRAWN_NODES} nodes that differ; this chain has {n:,}")
    least = np.where(np.arange(n) == chain.source, restart, 0.0)
    edges = np.argwhere(as_moves(chain.weights).toarray() > least) if unrolled is None else unrolled.edges
    texts = _folded(label.replace(", ", "\n") for label in chain.labels)
    places = _places(_distances(edges, n, chain.source), edges, texts)
    drawn = [places]
    if unrolled is not None and unrolled.relevant is not None:
        depths = goal_depths(unrolled.relevant)
        drawn.insert(0, _places(np.array([*depths.values()]), np.zeros((0, 2), np.int64), _folded(depths)))
    figure, axes, scale = figure_for(drawn)
    if unrolled is not None and unrolled.relevant is not None:
        _draw_goals(unrolled.relevant, axes[0], drawn[0], scale)
    kind = "chain" if unrolled is None else "marking chain"
    pen = Pen(axes[-1], scale, f"{kind}\n{n} nodes, {len(edges)} edges", places)
    for start, end in {tuple(sorted(edge)) for edge in edges.tolist() if edge[0] != edge[1]}:
        bend = min(0.12, 1 / math.dist(places[start], places[end]))  # long arrows would leave the picture
        pen.arrow(places[start], places[end], FAINT, _heads(edges, start, end), bend)
    dead = {*unrolled.dead_ends} if unrolled else set()
    for node, (place, text) in enumerate(zip(places, texts, strict=False)):
        is_exit = node in chain.goals[EXIT]
        colour = EXIT_COLOUR if is_exit else DEAD_COLOUR if node in dead else ROOM_COLOURS[node != chain.source]
        pen.node(place, colour, "")
        _below(axes[-1], place, text, scale)
    notes = ["not drawn: staying, and the restarts" if restart else "not drawn: staying"]
    notes += ["red nodes: dead ends"] * bool(dead) + ["red arrows: what is used up"] * (unrolled is not None)
    figure.supxlabel("\n".join(notes), fontsize=8 * max(scale, 0.7), color=INK, parse_math=False)
    return figure


def _draw_goals(rules: Rules, axes: Axes, places: list[Point], scale: float) -> None:
    pen = Pen(axes, scale, f"{rules.name}\ntarget {rules.target}", places)
    for first, last, is_used in links(rules):
        pen.arrow(places[first], places[last], USED_COLOUR if is_used else INK, bend=0.12)
    for goal, text, place in zip(rules.names, _folded(rules.names), places, strict=False):
        is_last = any(rules.target in way.gives for way in rules.rules[goal])
        pen.node(place, EXIT_COLOUR if is_last else ROOM_COLOURS[1], "", is_key=True)
        _below(axes, place, text, scale)


def _folded(texts: Iterable[str]) -> list[str]:
    return [fold(text, COLUMN - 0.2, LABEL_SIZE) for text in texts]


def _places(rows: NDArray[np.floating], edges: NDArray[np.integer], texts: list[str]) -> list[Point]:
    """Return the nodes' places, and as the last point the end of the longest label below the lowest node."""
    n_lines = max(text.count("\n") for text in texts)
    places = place_rows(rows, edges, n_lines)
    return [*places, (places[0][0], min(y for _, y in places) - TEXT_LINE * n_lines)]


def _distances(edges: NDArray[np.int64], n: int, source: int) -> NDArray[np.float64]:
    moves = sp.coo_array((np.ones(len(edges)), edges.T), shape=(n, n)).tocsr()
    return dijkstra(moves, indices=source, unweighted=True)


def _heads(edges: NDArray[np.int64], start: int, end: int) -> str:
    there, back = (edges == (start, end)).all(axis=1).any(), (edges == (end, start)).all(axis=1).any()
    return "<|-|>" if there and back else "-|>" if there else "<|-"


def _below(axes: Axes, place: Point, text: str, scale: float) -> None:
    size, (x, y) = LABEL_SIZE * scale, place
    words = {"fontsize": size, "ha": "center", "va": "top", "color": INK, "zorder": 5, "parse_math": False}
    axes.text(x, y - 0.45, text, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}, **words)
