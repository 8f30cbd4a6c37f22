"""The world that a config describes; only the world that is asked for is imported."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hierroom.goals.goal_set import GoalSet
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.world import Feature, World


@dataclass(frozen=True, eq=False)
class WorldSpec:
    """The spec that agents are made for: the attributes of a `World` that are known before it is made."""

    config: EnvConfig
    goals: GoalSet
    n_actions: int
    features: Mapping[str, Feature]

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle the config alone: features are functions without a name."""
        return world_spec, (self.config,)


def world_spec(config: EnvConfig) -> WorldSpec:
    """Return what agents in the world of a config are made for."""
    from hierroom.worlds.escape_room.world import EscapeRoomWorld

    return WorldSpec(config, EscapeRoomWorld.goals, config.n_actions, EscapeRoomWorld.features)


def make_world(
    config: EnvConfig,
    num_envs: int,
    *,
    seed: int | None = None,
    autoreset: bool = True,
    threads: int = 1,
    memories: Iterable[str] = (),
) -> World:
    """Return the `World` of a config.

    Args:
        seed: of the first episodes; None: call `World.reset` with one first.
        autoreset: whether an environment whose episode ends begins its next one in the same step.
        memories: what the world must remember of each episode.
    """
    from hierroom.worlds.escape_room.world import EscapeRoomWorld

    return EscapeRoomWorld(config, num_envs, seed=seed, autoreset=autoreset, threads=threads, memories=memories)
