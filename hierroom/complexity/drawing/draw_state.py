"""A picture of rules as a graph that shows the achieved, possible and pursued goals, and the counts of facts."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from hierroom.complexity.drawing.draw import draw_rules
from hierroom.goals import Rules
from hierroom.support.pictures import drawing
from hierroom.support.sheet import FAINT, INK, Sheet

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
