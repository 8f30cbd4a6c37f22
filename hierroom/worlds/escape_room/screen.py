"""Shows one EscapeRoom in the render mode of an environment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import require_name
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.render import default_tile_size, draw_level, text
from hierroom.worlds.escape_room.window import Window
from hierroom.worlds.world import RENDER_MODES


class LevelScreen:
    """Shows levels in one of `RENDER_MODES`, or nowhere for None: see `Screen`."""

    def __init__(self, engine: Engine, render_mode: str | None) -> None:
        require_name("render_mode must be one of", render_mode, (*RENDER_MODES, None))
        self.render_mode = render_mode
        self._engine = engine
        self._window = Window() if render_mode == "human" else None

    def show(self, env: int, goal: int) -> None:
        """Update the window, if there is one."""
        if self._window is not None:
            self._window.show(self._picture(env, goal))

    def render(self, env: int, goal: int) -> str | NDArray[np.uint8] | None:
        """Return text, a picture [H, W, 3] uint8 or None, as the mode asks."""
        if self.render_mode == "ansi":
            return text(self._engine.state[env], goal)
        if self.render_mode == "rgb_array":
            return self._picture(env, goal)
        self.show(env, goal)
        return None

    def _picture(self, env: int, goal: int) -> NDArray[np.uint8]:
        return draw_level(self._engine.state[env], goal, default_tile_size(self._engine.state.size))

    def close(self) -> None:
        """Close the window if it is open."""
        if self._window is not None:
            self._window.close()
