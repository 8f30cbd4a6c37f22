"""The spec and the reset options that Gymnasium requires of registered environments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from hierroom.goals import graph_specs
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.world import World


def checked_options(options: Any, world: World, *known: str) -> dict[str, Any]:
    """Return the options of a reset of a world as a dict, empty for None; warn once about unknown ones."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise InputError(f"options of a reset are a dict or None, not {shown(options)}")
    if ignored := [shown(name) for name in options if name not in known]:
        made = "pass graph and the like when making the environment"
        warn_once(f"a reset takes the options {' and '.join(known)}; it ignores {', '.join(ignored)} ({made})")
    if options.get("complexity") and world.complexity is None:
        raise InputError("a task without rules has no complexity; reset it without the option complexity")
    return dict(options)


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
