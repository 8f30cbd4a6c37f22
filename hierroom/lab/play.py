"""Play levels by hand, in a window, next to a goal graph that lights up as goals are reached."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pygame
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, NO_GOAL, GoalGraph
from hierroom.goals.tree import tree_places
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    DROP,
    FORWARD,
    KEY,
    LEFT,
    LOCKED_DOOR,
    OPEN,
    OPEN_DOOR,
    PICKUP,
    RIGHT,
    ROW_STEP,
)
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.level import goal_name
from hierroom.worlds.escape_room.render import ACTION_NAMES, draw_level
from hierroom.worlds.escape_room.rooms import rooms_of
from hierroom.worlds.window import Window, has_screen


class Game:
    """Levels that are played step by step.

    Args:
        make: makes the environment of a level, whose observations have the features of the agent.
        agent: a trained agent that can take over; it acts at every step, so that it remembers those of the person.
        seed: of the first level; each later one has the next seed.

    Attributes:
        message: the effect of the last step, or the reason why it had none.
    """

    def __init__(self, make: Callable[[], gymnasium.Env], agent: TrainedAgent | None = None, seed: int = 0) -> None:
        self._make, self.agent = make, agent
        self.is_piloted = self.has_hints = False
        self.begin(seed)

    def begin(self, seed: int) -> None:
        """Begin a level."""
        self.seed, self._env, self._memory = seed % 2**63, self._make(), None
        self._turns: Any = self._env.unwrapped.single.turns  # pyright: ignore[reportAttributeAccessIssue] - of hierroom
        self._observation, info = self._env.reset(seed=self.seed)
        self.graph: GoalGraph = self._turns.world.graph_of(self.state)
        self.shortest = info["shortest_length"]
        self.message, self.has_ended, self.has_escaped = "", False, False

    @property
    def state(self) -> State:
        """A copy of the level's state."""
        return self._turns.world.get_state()

    @property
    def goal(self) -> int:
        """The goal id that the agent's meta-controller pursues now; -1 for none."""
        return int(self._turns.goals[0])

    @property
    def hint(self) -> str:
        """The oracle's next action, and the number of actions to the exit, in words."""
        if self.has_ended:
            return "none, the level has ended"
        plan = self._turns.world.shortest_actions(0)
        return f"{ACTION_NAMES[int(plan[0])]} ({len(plan)} to the exit)"

    def name_of(self, goal: int) -> str:
        """Return the name of a goal of the level, such as ``"red key 1"``."""
        return goal_name(self.state.levels[0], goal)

    def step(self, action: int | None = None) -> None:
        """Take a step with the person's action, or if None with the agent's, unless the level has ended."""
        if self.has_ended:
            self.message = "the level has ended: n begins the next one, r this one again"
            return
        own = None
        if self.agent is not None:
            own, self._memory = self.agent.act(self._observation, self._memory, seed=self.seed)
        self._observation, _, terminated, truncated, info = self._env.step(own if action is None else action)
        self.has_escaped, self.has_ended = terminated, terminated or truncated
        event, n = info["goal_event"], info["length"]
        self.message = "" if event == NO_GOAL else f"{self.name_of(event)}!"
        if self.has_ended:
            self.message = f"escaped in {n} steps" if terminated else f"the limit of {n} steps is reached"

    def use(self) -> None:
        """Pick up or open the object in front; if impossible, take no step and set a message with the reason."""
        level = self.state.levels[0]
        tile = int(self.state.grids[0, level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]])
        if KEY <= tile < OPEN_DOOR:
            self.step(PICKUP)
        elif not LOCKED_DOOR <= tile < LOCKED_DOOR + len(COLOURS):
            self.message = "there is neither a key nor a locked door in front"
        elif level.keys >> level.branches[tile - LOCKED_DOOR] & 1:
            self.step(OPEN)
        else:
            self.message = f"this door needs {self.name_of(tile - LOCKED_DOOR)}"


LEVEL, PANEL, HEIGHT = 684, 390, 660  # pixels: at most the level's width, the panel's width, the least height
PAPER, INK, FAINT, ACCENT, GOOD = "#181c24", "#e8ecf3", "#96a0b0", "#6db3f5", "#46c86e"
SHADES = ("#f03c32", "#3cd750", "#5078ff", "#aa5aeb", "#f5e13c", "#a5a5a5")  # of `COLOURS`
SMALL, NORMAL = ImageFont.load_default(14), ImageFont.load_default(17)
KEYS = """arrows, wasd: move forward, turn left or right
space: pick up or open what is in front;  x: drop a key
o: the oracle's next action;  t: the agent takes over
n: the next level;  r: this one again;  q: quit"""


def game_picture(game: Game) -> NDArray[np.uint8]:
    """Return a picture [H, W, 3] of the level, facts, the goal graph and the keys."""
    level = draw_level(game.state, game.goal, max(8, LEVEL // game.state.size))
    image = Image.new("RGB", (len(level) + PANEL, max(len(level), HEIGHT)), PAPER)
    image.paste(Image.fromarray(level))
    draw, left, bottom = ImageDraw.Draw(image), len(level) + 22, image.height - 102
    _draw_tree(draw, game, left, _write_facts(draw, game, left) + 12, bottom - 20)
    draw.multiline_text((left, bottom), KEYS, FAINT, SMALL, spacing=7)
    return np.asarray(image)


def _write_facts(draw: ImageDraw.ImageDraw, game: Game, left: int) -> int:
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


FRAMES_PER_SECOND, FRAMES_PER_STEP = 30, 5  # an agent that plays takes a step in every fifth frame
NOWHERE = ("dummy", "offscreen", "evdev")  # SDL's drivers without a screen; nobody could see or end a game
MOVES = {"up": FORWARD, "w": FORWARD, "left": LEFT, "a": LEFT, "right": RIGHT, "d": RIGHT, "x": DROP}


class App:
    """A window to play a game in."""

    def __init__(self, game: Game) -> None:
        self.game, self.is_open, self.picture = game, True, game_picture(game)
        self.window, self._waited = Window(frames_per_second=FRAMES_PER_SECOND), 0
        if has_screen():  # else SDL would complain on standard error
            self.window.show(self.picture)
        if not has_screen() or (pygame.display.get_driver() in NOWHERE and "SDL_VIDEODRIVER" not in os.environ):
            self.window.close()
            raise InputError("play needs a screen, and there is none here; watch and report need none")
        pygame.key.set_repeat(280, 90)

    def run(self) -> None:
        """Play until the window is closed."""
        try:
            while self.is_open:
                self.frame()
        finally:
            self.window.close()

    def frame(self) -> None:
        """Heed keys, let the agent take a step if it plays and its step is due, and show the picture."""
        game, keys = self.game, self.window.pressed()
        for key in keys:
            self._press(game, key)
        self._waited = (self._waited + 1) % FRAMES_PER_STEP if game.is_piloted and not game.has_ended else 1
        if is_due := self._waited == 0:
            game.step()
        if keys or is_due:
            self.picture = game_picture(game)
        self.window.show(self.picture)

    def _press(self, game: Game, key: str) -> None:
        if key == "x" and not game.state.levels["can_drop"][0]:
            game.message = "keys cannot be dropped here; begin with --drop-key"
        elif key in MOVES or key == "space":
            game.is_piloted = False  # a person who moves takes over from the agent
            game.use() if key == "space" else game.step(MOVES[key])
        elif key == "t":
            game.is_piloted = game.agent is not None and not game.is_piloted
            whose = "the agent plays" if game.is_piloted else "you play"
            game.message = whose if game.agent else "begin with --agent RUN to let a trained agent take over"
        elif key in ("n", "r"):
            game.begin(game.seed + (key == "n"))
        elif key == "o":
            game.has_hints = not game.has_hints
        elif key in ("q", "escape", "quit"):
            self.is_open = False
