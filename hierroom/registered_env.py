"""What an environment knows of the id that `gymnasium.make` or `gymnasium.make_vec` made it by."""

from __future__ import annotations

from dataclasses import replace

import gymnasium
from gymnasium.envs.registration import EnvSpec

from hierroom.env_config import EnvConfig
from hierroom.errors import InputError


class RegisteredEnv:
    """An environment whose ``spec`` tells its step limit, and which is of the graph that its id names.

    Attributes:
        config: what the environment is made of.
    """

    config: EnvConfig
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The id's description and the arguments, with ``max_steps`` as ``max_episode_steps``.

        Raises:
            InputError: when it is set, if the id names a graph and another one was asked for.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        known = None if spec is None else gymnasium.registry.get(spec.id)
        named = {} if known is None else known.kwargs
        if spec is not None and "graph" in named and spec.kwargs.get("graph") != named["graph"]:
            raise InputError(
                f"{spec.id} is one goal graph's: give the graph {spec.kwargs.get('graph')!r} to hierroom/EscapeRoom-v0"
            )
        self._spec = spec and replace(spec, max_episode_steps=self.config.max_steps)
