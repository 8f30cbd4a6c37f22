"""A window on the screen that shows pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.errors import InputError


class Window:
    """A window on the screen that opens with the first picture.

    Args:
        title: text of the title bar.
        frames_per_second: highest frame rate, above 0; `show` waits if it is called faster.
    """

    def __init__(self, title: str = "hierroom", frames_per_second: int = 10):
        self.title = title
        self.frames_per_second = frames_per_second
        self._screen = None
        self._clock = None

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a picture [H, W, 3] uint8 and process the window's events.

        Raises:
            InputError: if there is no screen on which to open a window.
        """
        import pygame  # imported only when needed: it loads slowly, and servers have no screen

        height, width = frame.shape[:2]
        if self._screen is None or self._screen.get_size() != (width, height):
            try:
                pygame.display.init()
                self._screen = pygame.display.set_mode((width, height))
            except pygame.error as error:
                raise InputError(f"cannot open a window ({error}); render_mode 'rgb_array' needs none") from error
            pygame.display.set_caption(self.title)
            self._clock = pygame.time.Clock()
        assert self._clock is not None
        self._screen.blit(pygame.surfarray.make_surface(frame.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self.frames_per_second)

    def close(self) -> None:
        """Close the window if it is open."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = self._clock = None
