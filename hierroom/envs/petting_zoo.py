"""The base of the AEC and the parallel environment: the two agents' spaces, the state and the pictures of one world."""

from __future__ import annotations

from functools import cached_property, partial
from operator import getitem
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.envs.single_env import SingleEnv
from hierroom.goals import GraphSpecs
from hierroom.turns.records import AGENTS
from hierroom.worlds.env_config import FRAMES_PER_SECOND, EnvConfig
from hierroom.worlds.world import RENDER_MODES


def class_metadata() -> dict[str, Any]:
    """Return a new dict of metadata for the class of an environment."""
    return {"name": "hierroom_v0", "render_modes": list(RENDER_MODES), "render_fps": FRAMES_PER_SECOND}


class TwoAgentEnv:
    """The base of PettingZoo environments, on a `SingleEnv`; the arguments are those of `hierroom.aec_env.raw_env`."""

    def __init__(self, /, graph: GraphSpecs = "c", *, render_mode: str | None = None, **entries: Any) -> None:
        config = EnvConfig.of_arguments({"graph": graph, "reward": "intrinsic", **entries}, ("render_mode",))
        self.single = SingleEnv(config, render_mode)
        self.render_mode = render_mode
        self.agents: list[str] = []
        self.possible_agents = list(AGENTS)
        self.observation_spaces = self.single.observation_spaces
        self.action_spaces = self.single.action_spaces
        # Fast, as PettingZoo's wrapper asks for a space at each step; a deep copy would share a method of the dict.
        self.observation_space = partial(getitem, self.observation_spaces)
        self.action_space = partial(getitem, self.action_spaces)

    @cached_property
    def state_space(self) -> spaces.Box:
        """The space of `state`, made when it is first asked for, because it may be large."""
        return self.single.turns.world.global_state_space

    @property
    def complexity(self) -> Any:
        """Return the report on the goal graph or rules, or on the hardest of several goal graphs; None if unknown."""
        return self.single.complexity

    def state(self) -> NDArray[np.uint8]:
        """Return the world's `global_state`; in EscapeRooms, it is the whole grid [size, size, 4]."""
        return self.single.turns.world.global_state(self.single.goal)

    def render(self) -> str | NDArray[np.uint8] | None:
        """Return the level as text or as a picture [H, W, 3], or show it in a window, with the current subgoal."""
        return self.single.render()

    def close(self) -> None:
        """Close the window, if one is open, and the environments of a task."""
        self.single.close()
