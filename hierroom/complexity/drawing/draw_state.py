"""A picture of rules as a graph that shows the achieved, possible and pursued goals, and the counts of facts."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.drawing.drawn_places import Point, place_rows
from hierroom.complexity.requirements import goal_depths, links
from hierroom.goals import Rules

COLUMN, ROW, HALF_HEIGHT, LEGEND = 42, 33, 13, 34
"""Pixels for a unit of the drawing across and down, half the height of a goal, and the height of the legend."""
TIGHT_ROW, FULL_HEIGHT = 18, 600
"""Fewest pixels for a unit down, and the height beyond which units have fewer than ROW."""
PAPER, INK, FADED, DONE, PURSUED, USED = "#ffffff", "#202020", "#a0a0a0", "#bfe5c8", "#f28e2b", "#e15759"
WIDEST_NAME = 84
"""Pixels of the widest name that is not shortened, so that names in a row stay apart."""


@lru_cache(maxsize=256)
def rules_picture(
    rules: Rules, achieved: frozenset[str], marking: tuple[int, ...], goal: str | None
) -> NDArray[np.uint8]:
    """Draw rules and their state: [H, W, 3] uint8. All pictures of the same rules have the same size.

    Arrows lead from a goal to the goals that require what it gives. An achieved goal is filled, with the count of the
    fact that it gives after its name. A goal that cannot be achieved now is faded. The pursued goal has a frame.

    Args:
        rules: the rules.
        achieved: names of the goals that were achieved in the episode.
        marking: [F] the count of each fact.
        goal: the name of the goal that is pursued, or None.
    """
    from PIL import Image, ImageDraw, ImageFont

    places, (width, height) = _layout(rules)
    image = Image.new("RGB", (width, height), PAPER)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=11)
    for giver, taker, is_used in links(rules):
        _arrow(draw, places[giver], places[taker], USED if is_used else FADED)
    after, applies = rules.apply_all(marking)
    can_be_done = applies & (after != np.array(marking)).any(axis=-1)
    for name, (x, y), is_within_reach in zip(rules.names, places, can_be_done.tolist(), strict=True):
        held = max(
            marking[rules.facts.index(fact)] for way in rules.rules[name] for fact in way.gives or (rules.target,)
        )
        label = name
        while draw.textlength(label, font=font) > WIDEST_NAME:
            label = f"{label[:-2]}…"
        label += f" x{held}" if held and name in achieved else ""
        half = draw.textlength(label, font=font) / 2 + 5
        box = (x - half, y - HALF_HEIGHT, x + half, y + HALF_HEIGHT)
        if name == goal:
            draw.rectangle((box[0] - 4, box[1] - 4, box[2] + 4, box[3] + 4), outline=PURSUED, width=3)
        ink = INK if is_within_reach or name in achieved else FADED
        draw.rectangle(box, fill=DONE if name in achieved else PAPER, outline=ink, width=2 if is_within_reach else 1)
        draw.text((x, y), label, fill=ink, font=font, anchor="mm")
    legend = ("filled: achieved; x2: the count", "black: can be done; red: is used up")
    for line, words in enumerate(legend):
        draw.text((6, height - LEGEND + 15 * line), words, fill=FADED, font=font)
    picture = np.asarray(image)
    picture.setflags(write=False)
    return picture


@lru_cache(maxsize=16)
def _layout(rules: Rules) -> tuple[list[Point], tuple[int, int]]:
    places = place_rows(np.array([*goal_depths(rules).values()]), np.array([link[:2] for link in links(rules)]), 0)
    xs, ys = zip(*places, strict=True)
    row = min(ROW, max(TIGHT_ROW, FULL_HEIGHT / (max(ys) - min(ys) + 1.6)))
    at = [(COLUMN * (x - min(xs) + 1.4), row * (max(ys) - y + 0.8)) for x, y in places]
    wide = max(x for x, _ in at) + 1.4 * COLUMN
    return at, (max(round(wide), 240), round(max(y for _, y in at) + 0.8 * ROW) + LEGEND)


def _arrow(draw: object, start: Point, end: Point, colour: str) -> None:
    (x, y), (to_x, to_y) = start, end
    down = np.sign(to_y - y)
    aside = 0 if down else 1.1 * COLUMN * np.sign(to_x - x)  # in the same row the head is between the goals
    tip, tail = (to_x - aside, to_y - down * HALF_HEIGHT), (x, y + down * HALF_HEIGHT)
    draw.line((*tail, *tip), fill=colour, width=1)  # pyright: ignore[reportAttributeAccessIssue] - of Pillow
    angle = np.arctan2(tip[1] - tail[1], tip[0] - tail[0])
    sides = [(tip[0] - 7 * np.cos(angle + turn), tip[1] - 7 * np.sin(angle + turn)) for turn in (-0.4, 0.4)]
    draw.polygon([tip, *sides], fill=colour)  # pyright: ignore[reportAttributeAccessIssue] - of Pillow
