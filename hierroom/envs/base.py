"""The bases of the four APIs' classes: their common methods, and what Gymnasium requires of registered ids."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from operator import getitem
from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from hierroom.envs.single_env import SingleEnv
from hierroom.goals import GraphSpecs, graph_specs
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS
from hierroom.worlds.env_config import FRAMES_PER_SECOND, EnvConfig
from hierroom.worlds.world import RENDER_MODES


def class_metadata() -> dict[str, Any]:
    """Return a new dict of metadata for the class of an environment."""
    return {"name": "hierroom_v0", "render_modes": list(RENDER_MODES), "render_fps": FRAMES_PER_SECOND}


class OnSingleEnv:
    """The methods that environments on a `SingleEnv` share."""

    single: SingleEnv

    @property
    def complexity(self) -> Any:
        """Return the report on the goal graph or rules, or on the hardest of several goal graphs; None if unknown."""
        return self.single.turns.world.complexity

    def render(self) -> str | NDArray[np.uint8] | None:
        """Return the level as text or as a picture [H, W, 3], or show it in a window, with the current subgoal."""
        return self.single.render()

    def close(self) -> None:
        """Close the window, if one is open, and the environments of a task."""
        self.single.close()


class TwoAgentEnv(OnSingleEnv):
    """The base of PettingZoo environments, on a `SingleEnv`; the arguments are those of `hierroom.aec_env.raw_env`."""

    def __init__(self, /, graph: GraphSpecs = "c", *, render_mode: str | None = None, **entries: Any) -> None:
        config = EnvConfig.of_arguments({"graph": graph, **entries}, ("render_mode",))
        self.single = SingleEnv(config, render_mode)
        self.render_mode = render_mode
        self.agents: list[str] = []
        self.possible_agents = list(AGENTS)
        self.observation_spaces = self.single.observation_spaces
        self.action_spaces = self.single.action_spaces
        # Fast, as PettingZoo's wrapper asks for a space at each step; a deep copy would share a method of the dict.
        self.observation_space = partial(getitem, self.observation_spaces)
        self.action_space = partial(getitem, self.action_spaces)


class RegisteredEnv:
    """An environment with a registered id, which may determine its graphs; ``spec`` has ``max_steps`` of ``config``."""

    config: EnvConfig
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The id's description with the environment's arguments, and its ``max_steps`` as ``max_episode_steps``."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        known = None if spec is None else gymnasium.registry.get(spec.id)
        if spec is not None and known is not None:
            if "graph" in known.kwargs and (kind := self.config.kind) != "graph":
                raise InputError(f"{spec.id} has its own graphs: give a {kind} to hierroom/EscapeRoom-v0")
            for name in [name for name in ("graph", "exclude") if name in known.kwargs]:
                given = spec.kwargs.get(name, ())
                if graph_specs(given) != graph_specs(known.kwargs[name]):
                    raise InputError(f"{spec.id} has its own graphs: give {name} {given!r} to hierroom/EscapeRoom-v0")
        self._spec = spec and replace(spec, max_episode_steps=self.config.max_steps)
