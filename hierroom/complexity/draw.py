"""Drawings of goal graphs, next to their augmented graphs if these can be read, and of the goals of rules."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import networkx as nx
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph
from hierroom.complexity.draw_augmented import draw_augmented, notes_of_augmented
from hierroom.complexity.requirements import goal_depths, links
from hierroom.goals import Rules
from hierroom.goals.drawing import draw_goals
from hierroom.support.pictures import drawing
from hierroom.support.sheet import EXIT_COLOUR, FAINT, INK, PALE, USED_COLOUR, Sheet

MOST_NODES, MOST_POINTS = 250, 1250.0
"""The most nodes, and the largest size, of an augmented graph that is drawn."""


def figure_of_graph(augmented: AugmentedGraph) -> Figure:
    """Return the figure of a goal graph, next to its augmented graph if that can be read."""
    graph, n = augmented.graph, len(augmented.nodes)
    title = f"goal graph {graph.name}\n{graph.n_rooms} rooms, exit depth {graph.exit_depth}, width {graph.width}"
    sheet = draw_goals(Sheet(), graph.to_networkx(), title)
    is_drawn = n <= MOST_NODES and draw_augmented(sheet, augmented, MOST_POINTS)
    return sheet.finish(notes_of_augmented(augmented) if is_drawn else [f"not drawn: the augmented graph, {n:,} nodes"])


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
