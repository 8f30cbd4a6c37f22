"""The picture of a game: the level, and a goal graph that lights up as goals are reached."""

from __future__ import annotations

import textwrap

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, NO_GOAL
from hierroom.goals.tree import tree_places
from hierroom.lab.play.game import Game
from hierroom.worlds.escape_room.render import draw_level
from hierroom.worlds.escape_room.rooms import rooms_of

LEVEL, PANEL, HEIGHT = 684, 390, 660  # pixels: at most the level's width, the panel's width, the least height
PAPER, INK, FAINT, ACCENT, GOOD, FOG = "#181c24", "#e8ecf3", "#96a0b0", "#6db3f5", "#46c86e", 34
SHADES = ("#f03c32", "#3cd750", "#5078ff", "#aa5aeb", "#f5e13c", "#a5a5a5")  # of `COLOURS`
SMALL, NORMAL = ImageFont.load_default(14), ImageFont.load_default(17)
KEYS = """arrows, wasd: move forward, turn left or right
space: pick up or open what is in front;  x: drop a key
o: the oracle's next action;  t: the agent takes over
f: fog, which hides what was not seen yet
n: the next level;  r: this one again;  q: quit"""


def game_picture(game: Game) -> NDArray[np.uint8]:
    """Return a picture [H, W, 3] of the level with the fog, facts, the goal graph and the keys."""
    size, side = game.state.size, max(8, LEVEL // game.state.size)
    level = draw_level(game.state, game.goal, side)
    if game.has_fog:
        level.reshape(size, side, size, side, 3).swapaxes(1, 2)[~game.seen] = FOG
    image = Image.new("RGB", (len(level) + PANEL, max(len(level), HEIGHT)), PAPER)
    image.paste(Image.fromarray(level))
    draw, left, bottom = ImageDraw.Draw(image), len(level) + 22, image.height - 124
    _draw_tree(draw, game, left, _write_facts(draw, game, left) + 12, bottom - 20)
    draw.multiline_text((left, bottom), KEYS, FAINT, SMALL, spacing=7)
    return np.asarray(image)


def _write_facts(draw: ImageDraw.ImageDraw, game: Game, left: int) -> int:
    """Write facts on the game, and return how far down they reach."""
    level = game.state.levels[0]
    held = [game.name_of(colour) for room, colour in enumerate(level.colours.tolist()) if level.keys >> room & 1]
    facts = {
        f"graph {game.graph.name}": INK,
        f"step {level.steps} of {level.max_steps}, shortest {game.shortest}": INK,
        f"keys held: {', '.join(held) or 'none'}": INK,
        f"subgoal: {game.name_of(game.goal)}" * (game.goal != NO_GOAL): INK,
        f"oracle: {game.hint}" * game.has_hints: ACCENT,
        game.message: GOOD if game.has_escaped or game.message.endswith("!") else ACCENT,
    }
    lines = [(line, colour) for words, colour in facts.items() for line in textwrap.wrap(words, 42)]
    for number, (line, colour) in enumerate(lines):
        draw.text((left, 14 + 23 * number), line, colour, NORMAL)
    return 14 + 23 * len(lines)


def _draw_tree(draw: ImageDraw.ImageDraw, game: Game, left: int, top: int, bottom: int) -> None:
    """Draw each room as a circle below the room of its key, which is a square on the line between them."""
    graph, level, places = game.graph, game.state.levels[0], np.array(tree_places(game.graph.key_rooms))
    unit = np.minimum(78, (PANEL - 40, bottom - top) / (1 + places.max(axis=0)))
    at, half = (left, top) + unit * (places + 0.5), int(min(max(8, unit.min() / 3.4), 18))

    def mark(place: NDArray, half: float, corner: float, shade: str, room: int, is_lit: bool, goal: int) -> None:
        if goal == game.goal:
            draw.rounded_rectangle((*(place - half - 6), *(place + half + 6)), corner + 6, outline=ACCENT, width=3)
        draw.rounded_rectangle((*(place - half), *(place + half)), corner, shade if is_lit else PAPER, shade, 2)
        draw.text((*place,), str(room), "black" if is_lit else INK, SMALL, anchor="mm")

    for room, home in enumerate(graph.key_rooms, start=1):
        draw.line((*at[home], *at[room]), FAINT)
    mark(at[0], half, half, FAINT, 0, True, EXIT_GOAL + 1)
    for room, home in enumerate(graph.key_rooms, start=1):
        colour = int(level.colours[room - 1])
        is_open, is_found = level.doors >> room - 1 & 1, (level.doors | level.keys) >> room - 1 & 1
        mark((at[home] + at[room]) / 2, half / 2 + 1, 3, SHADES[colour], room, is_found, colour)
        if room == graph.exit_room:
            mark(at[room], half + 4, half + 4, GOOD, room, game.has_escaped, EXIT_GOAL)
            draw.text((*(at[room] + (half + 7, 0)),), "exit", GOOD, SMALL, anchor="lm")
        mark(at[room], half, half, SHADES[colour], room, is_open, FIRST_DOOR_GOAL + colour)
    x, y = at[rooms_of(game.state.levels, game.state.maps)[0]] - (half + 5, 0)
    draw.polygon([(x, y), (x - 11, y - 7), (x - 11, y + 7)], SHADES[0])  # the agent
