"""The MiniGrid view: our Gymnasium environment as a MiniGrid environment, for MiniGrid's wrappers and their users."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from minigrid.core.actions import Actions
from minigrid.core.grid import Grid
from minigrid.core.mission import MissionSpace
from minigrid.minigrid_env import MiniGridEnv
from numpy.typing import NDArray

from hierroom.envs.single_env import as_action
from hierroom.goals import COLOURS
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.render import minigrid_objects
from hierroom.worlds.escape_room.tiles import DOOR_ID

MISSIONS = (
    *(f"pick up the {colour} key" for colour in COLOURS),
    *(f"open the {colour} door" for colour in COLOURS),
    "get to the green goal square",
    "traverse the rooms to get to the goal",
)
"""The mission for each goal id, in words of MiniGrid's vocabulary; the last mission is for no goal."""
ACTIONS = {
    Actions.left: constants.LEFT,
    Actions.right: constants.RIGHT,
    Actions.forward: constants.FORWARD,
    Actions.pickup: constants.PICKUP,
    Actions.drop: constants.DROP,
    Actions.toggle: constants.OPEN,
    Actions.done: len(Actions) - 1,  # not an action of any level
}
"""Our action for each action of MiniGrid."""
_OPEN, _LOCKED = 0, 2


class minigrid_view(MiniGridEnv):
    """One EscapeRoom as a MiniGrid environment, which MiniGrid's wrappers accept.

    | | |
    |---|---|
    | observations | MiniGrid's ``image``, ``direction`` and ``mission``, the goal in words |
    | actions | MiniGrid's: 0 left, 1 right, 2 forward, 3 pickup, 4 drop, 5 toggle, 6 done |
    | rules that are not MiniGrid's | several keys can be held, and ``image`` shows the one that would be dropped; |
    | | toggle opens a locked door with its key and closes none; done, and drop without ``drop_key``, cost the step |
    | rewards, ends, infos, pictures | those of the environment |

    Args:
        env: an environment such as ``hierroom/EscapeRoom-a-v0`` from `gymnasium.make`, without further wrappers.

    Attributes:
        escape_room: the environment.

    Examples:
        >>> env = hierroom.minigrid_view(gymnasium.make("hierroom/EscapeRoom-a-v0"))
        >>> observation, info = env.reset(seed=0)
        >>> observation["image"].shape, env.actions.toggle.value
        ((7, 7, 3), 5)
    """

    def __init__(self, env: gymnasium.Env) -> None:
        single = getattr(getattr(env, "unwrapped", None), "single", None)
        if single is None or not isinstance(env, gymnasium.Env):
            raise InputError(f"minigrid_view takes a Gymnasium environment of hierroom, not {env!r}")
        if not isinstance(env.observation_space, spaces.Dict) or "goal" not in env.observation_space.spaces:
            raise InputError("minigrid_view takes the environment without wrappers that change its observations")
        if single.turns.config.task is not None:
            raise InputError(f"minigrid_view shows levels of EscapeRooms; {single.turns.config.names[0]} has none")
        self.escape_room = env
        self._single = single
        config = single.turns.config
        super().__init__(MissionSpace(_mission, [list(MISSIONS)]), grid_size=config.size, max_steps=config.max_steps)
        self.metadata = env.metadata
        self.render_mode = env.render_mode
        self._tiles = np.zeros(0, np.uint8)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        """Begin an episode, as the environment does."""
        observation, info = self.escape_room.reset(seed=seed, options=options)  # refuses an invalid seed
        gymnasium.Env.reset(self, seed=None if seed is None else int(seed))  # Gymnasium accepts no NumPy numbers
        self.grid = Grid(self.width, self.height)
        self._tiles = np.full((self.height, self.width), constants.EMPTY, np.uint8)
        self._follow()
        return self._view(observation), info

    def step(self, action: int):
        """Take one of MiniGrid's actions."""
        chosen = as_action(action)
        if chosen not in ACTIONS:
            raise InputError(f"MiniGrid's actions are 0 to {len(ACTIONS) - 1}, not {action!r}")
        observation, *results = self.escape_room.step(ACTIONS[Actions(chosen)])
        self._follow()
        return self._view(observation), *results

    def render(self):
        """Render as the environment does."""
        return self.escape_room.render()

    def close(self) -> None:
        """Close the window, if one is open."""
        self.escape_room.close()

    def _follow(self) -> None:
        state: State = self._single.turns.world.state
        level, tiles = state.levels[0], state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN]
        for row, col in np.argwhere(tiles != self._tiles):
            self.grid.set(int(col), int(row), minigrid_objects()[tiles[row, col]])
        self._tiles[:] = tiles
        self.agent_pos = int(level.col) - MARGIN, int(level.row) - MARGIN
        self.agent_dir = int(level.direction)
        self.step_count = int(level.steps)
        carried = int(level.carried)
        self.carrying = None if carried < 0 else minigrid_objects()[constants.KEY + level.colours[carried]]
        self.mission = MISSIONS[self._single.goal]

    def _view(self, observation: dict[str, NDArray]) -> dict[str, Any]:
        image = observation["observation"]
        is_open = image[..., 2] == 1
        image[..., 2] = np.where((image[..., 0] == DOOR_ID) & ~is_open, _LOCKED, _OPEN)
        return {"image": image, "direction": observation["direction"], "mission": self.mission}


def _mission(mission: str) -> str:
    return mission
