"""A window on the screen that shows pictures, and a display of states in an environment's render mode."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, require_name
from hierroom.worlds.world import RENDER_MODES, Replayer


def has_screen() -> bool:
    """Return whether there is a screen to open a window on, as far as the environment's variables tell."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, names))


@contextmanager
def without_window() -> Iterator[None]:
    """Keep SDL, pygame's library, from looking for a screen where there is none, as it would print an error."""
    if has_screen():
        yield
        return
    os.environ["SDL_VIDEODRIVER"] = "offscreen,dummy"
    try:
        yield
    finally:
        os.environ.pop("SDL_VIDEODRIVER", None)


class Window:
    """A window on the screen that opens with the first picture; `show` waits for ``frames_per_second``."""

    def __init__(self, title: str = "hierroom", frames_per_second: float = 10):
        self.title = title
        self.frames_per_second = frames_per_second
        self._screen = None
        self._clock = None

    def __getstate__(self) -> dict[str, Any]:
        """Leave the window out; a copy opens its own with its first picture."""
        return {**self.__dict__, "_screen": None, "_clock": None}

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a picture [H, W, 3] uint8 and process the window's events."""
        import pygame  # loads slowly, and servers have no screen

        height, width = frame.shape[:2]
        # pygame has one screen per process: closing it in one window closes it for all.
        screen = pygame.display.get_surface()
        if self._screen is None or self._screen is not screen or self._screen.get_size() != (width, height):
            try:
                pygame.display.init()
                self._screen = pygame.display.set_mode((width, height))
            except pygame.error as error:
                raise InputError(
                    f"cannot open a window ({error}): it needs a screen; render_mode 'rgb_array' needs none"
                ) from error
            self._clock = pygame.time.Clock()
        assert self._clock is not None
        pygame.display.set_caption(self.title)
        self._screen.blit(pygame.surfarray.make_surface(frame.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self.frames_per_second)

    def play(self, frames: Iterable[NDArray[np.uint8]]) -> Literal["ended", "skipped", "closed"]:
        """Show pictures [H, W, 3] uint8 one after the other, and return how the show ended.

        Space pauses and resumes, the right arrow takes one step, and up and down change the speed. The key n skips the
        rest of the pictures; q, escape or the window's close button closes.
        """
        is_paused = False
        for frame in frames:
            is_next = False
            while not is_next:
                self.show(frame)
                is_next = not is_paused
                for key in self.pressed():
                    if key in ("quit", "q", "escape"):
                        return "closed"
                    if key == "n":
                        return "skipped"
                    if key == "space":
                        is_paused = not is_paused
                        is_next = not is_paused
                    elif key == "right":
                        is_paused = is_next = True
                    elif key in ("up", "down"):
                        faster = self.frames_per_second * (1.5 if key == "up" else 1 / 1.5)
                        self.frames_per_second = min(max(faster, 1), 100)
        return "ended"

    def pressed(self) -> list[str]:
        """Return the names of the keys pressed since the last call, and ``"quit"`` for the close button."""
        import pygame

        events = pygame.event.get((pygame.QUIT, pygame.KEYDOWN))
        return ["quit" if event.type == pygame.QUIT else pygame.key.name(event.key) for event in events]

    def close(self) -> None:
        """Close the window if it is open."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = self._clock = None


class StateScreen:
    """Shows states in one of `RENDER_MODES`; None shows nothing.

    Args:
        state_of: function from the index of an environment to its state.
        replayer: draws states.
        render_mode: the mode.
    """

    def __init__(self, state_of: Callable[[int], Any], replayer: Replayer, render_mode: str | None) -> None:
        require_name("render_mode must be one of", render_mode, (*RENDER_MODES, None))
        self.render_mode = render_mode
        self._state_of, self._replayer = state_of, replayer
        self._window = Window() if render_mode == "human" else None

    def show(self, env: int, goal: int) -> None:
        """Update the window, if there is one."""
        if self._window is not None:
            self._window.show(self._picture(env, goal))

    def render(self, env: int, goal: int) -> str | NDArray[np.uint8] | None:
        """Return text, a picture [H, W, 3] uint8 or None, depending on the mode."""
        if self.render_mode == "ansi":
            return self._replayer.text(self._state_of(env), goal)
        if self.render_mode == "rgb_array":
            return self._picture(env, goal)
        self.show(env, goal)
        return None

    def _picture(self, env: int, goal: int) -> NDArray[np.uint8]:
        state = self._state_of(env)
        return self._replayer.picture(state, goal, self._replayer.window_tile_size(state), "")

    def close(self) -> None:
        """Close the window if it is open."""
        if self._window is not None:
            self._window.close()
