"""The window of a game: it reads keys and shows pictures."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pygame

from hierroom.lab.play.board import Board, window_size
from hierroom.lab.play.game import Game
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, RIGHT

FRAMES_PER_SECOND, STEPS_PER_SECOND = 30, 6
NOWHERE = ("dummy", "offscreen", "evdev")  # SDL's drivers without a screen; nobody could see or end a game
MOVES = {
    pygame.K_UP: FORWARD,
    pygame.K_w: FORWARD,
    pygame.K_LEFT: LEFT,
    pygame.K_a: LEFT,
    pygame.K_RIGHT: RIGHT,
    pygame.K_d: RIGHT,
    pygame.K_x: DROP,
}


class App:
    """A window to play a game in; an agent that has taken over plays `STEPS_PER_SECOND`."""

    def __init__(self, game: Game) -> None:
        self.game, self.is_open = game, True
        self._wait, self._waited = 1000 / STEPS_PER_SECOND, 0.0
        try:
            with _quiet():
                pygame.display.init()
            if pygame.display.get_driver() in NOWHERE and "SDL_VIDEODRIVER" not in os.environ:
                pygame.display.quit()
                raise InputError("play needs a screen, and there is none here; watch and report need none")
            self.surface = pygame.display.set_mode(window_size(game.state.size))
        except pygame.error as error:
            raise InputError(f"cannot open a window ({error}): play needs a screen") from error
        pygame.display.set_caption("hierroom")
        pygame.key.set_repeat(280, 90)
        self._board, self._clock = Board(self.surface), pygame.time.Clock()
        self._board.draw(game)
        pygame.display.flip()

    def run(self) -> None:
        """Play until the window is closed."""
        try:
            while self.is_open:
                self.frame(self._clock.tick(FRAMES_PER_SECOND))
        finally:
            pygame.display.quit()

    def frame(self, milliseconds: float) -> None:
        """Handle keys, let the agent take a step if it plays and its step is due, and draw."""
        is_changed = False
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.is_open = False
            elif event.type == pygame.KEYDOWN:
                self._press(event.key)
                is_changed = True
            elif event.type in (pygame.WINDOWEXPOSED, pygame.WINDOWSIZECHANGED):
                is_changed = True
        if self.game.is_piloted and not self.game.has_ended:
            self._waited += milliseconds
            if self._waited >= self._wait:
                self._waited, is_changed = 0.0, True
                self.game.step()
        if is_changed and self.is_open:
            self._board.draw(self.game)
            pygame.display.flip()

    def _press(self, key: int) -> None:
        game = self.game
        commands = {pygame.K_SPACE: game.use, pygame.K_t: game.switch_pilot}
        commands |= {pygame.K_n: game.next_level, pygame.K_r: game.restart}
        if key == pygame.K_x and game.turns.world.n_actions <= DROP:
            game.message = "keys cannot be dropped here; begin with --drop-key"
        elif key in MOVES:
            game.is_piloted = False  # a person who moves takes over from the agent
            game.step(MOVES[key])
        elif key in commands:
            commands[key]()
        elif key == pygame.K_o:
            game.has_hints = not game.has_hints
        elif key == pygame.K_f:
            game.has_fog = not game.has_fog
        elif key in (pygame.K_q, pygame.K_ESCAPE):
            self.is_open = False


@contextmanager
def _quiet() -> Iterator[None]:
    """Hide messages that SDL writes to standard error while it looks for a screen."""
    shown, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(shown, 2)
        os.close(shown)
        os.close(nowhere)
