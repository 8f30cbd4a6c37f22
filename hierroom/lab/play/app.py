"""The window of a game: it reads keys and shows pictures."""

from __future__ import annotations

import os

import pygame

from hierroom.lab.play.game import Game
from hierroom.lab.play.picture import game_picture
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, RIGHT
from hierroom.worlds.window import Window, has_screen

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
        elif key == "f":
            game.has_fog = not game.has_fog
        elif key in ("q", "escape", "quit"):
            self.is_open = False
