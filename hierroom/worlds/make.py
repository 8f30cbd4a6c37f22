"""Make the world of a config: the EscapeRoom or a task's world. Only the module of the requested world is imported."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

from hierroom.goals.goal_set import GoalSet
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.support.plugins import load_plugin
from hierroom.support.schema import Whole
from hierroom.worlds.actions import Actions, DiscreteActions, actions_in
from hierroom.worlds.env_config import MOST_ENVS, SHIPPED, EnvConfig, is_task, ships
from hierroom.worlds.world import Feature

if TYPE_CHECKING:  # loads the compiler
    from hierroom.worlds.base import BaseWorld


class WorldMaker(Protocol):
    """A task, which makes its worlds; `EnvConfig.task` is one or names one.

    Attributes:
        name: the name in errors; in titles and tables, where it is not named ``package.module:name``.
        goal_set: the goals.
        n_actions: the controller's number of actions; 0 if they are arrays, and then it has ``actions``, their kind.
        features: features that networks can read, by name, in addition to those of every world (`features.offered`).
        controller_features: names of the features that the controller's network reads by default.
        meta_features: names of the features that a learned meta-controller's network reads by default.
        max_steps: default number of steps after which an episode is truncated.
    """

    name: str
    goal_set: GoalSet
    n_actions: int
    features: Mapping[str, Feature]
    controller_features: tuple[str, ...]
    meta_features: tuple[str, ...]
    max_steps: int

    def make_world(self, config: EnvConfig, num_envs: int, **settings: Any) -> BaseWorld:
        """Return a world of N environments; ``settings`` are all the settings of the function `make_world`."""
        ...  # pyright: ignore[reportReturnType]


def find_task(spec: Any) -> WorldMaker | None:
    """Return the task that `EnvConfig.task` is or names, or None (the EscapeRoom) if it is None."""
    if spec is None or is_task(spec):
        return spec
    word, _, rest = spec.partition(":")
    if ships(spec):
        module, _, name = SHIPPED[word].partition(":")
        return getattr(importlib.import_module(module), name)(rest)
    shipped = [f"{word}:..." for word in SHIPPED]
    task = load_plugin(spec, "task", shipped, "name")
    if not is_task(task):
        raise InputError(f"the task {spec!r} must be a hierroom.Task, not {shown(task)}")
    return task


def name_in_module(task: WorldMaker) -> str:
    """Return ``package.module:name`` of a task, by which a run finds it again.

    Among several modules, prefer one that its functions come from, and use a script (``__main__``) last.
    """
    found = [
        (module, name)
        for module, loaded in sorted(sys.modules.items())
        if module != "__mp_main__"  # another name of __main__, by multiprocessing
        for name, value in ([*vars(loaded).items()] if isinstance(loaded, ModuleType) else ())
        if value is task
    ]
    if not found:
        raise InputError(f"name the task of a run like package.module:name; no module has a name for {task.name}")
    homes = getattr(task, "homes", ())
    module, name = min(found, key=lambda one: (one[0] not in homes, one[0] == "__main__", one))
    if module == "__main__":
        warn_once(
            f"only this process can open runs of {name}, a task of __main__; define it in a module that both import"
        )
    return f"{module}:{name}"


@dataclass(frozen=True, eq=False)
class WorldSpec:
    """The attributes of a world that are known before it is made, and that agents need.

    The features at the end are those that agents read where their config names none. In EscapeRooms it always does.
    """

    config: EnvConfig
    goals: GoalSet
    actions: Actions
    features: Mapping[str, Feature]
    controller_features: tuple[str, ...] = ()
    meta_features: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle only the config, because features contain functions without a name."""
        return world_spec, (self.config,)


def world_spec(config: EnvConfig) -> WorldSpec:
    """Return the spec of a config's world."""
    if (task := find_task(config.task)) is not None:
        usual = task.controller_features, task.meta_features
        return WorldSpec(config, task.goal_set, actions_in(task), task.features, *usual)
    from hierroom.worlds.escape_room.world import EscapeRoomWorld

    actions = DiscreteActions(6 if config.drop_key else 5)
    return WorldSpec(config, EscapeRoomWorld.goals, actions, EscapeRoomWorld.features)


def make_world(
    config: EnvConfig,
    num_envs: int,
    *,
    seed: int | None = None,
    autoreset: bool = True,
    threads: int = 1,
    memories: Iterable[str] = (),
) -> BaseWorld:
    """Return the world of a config.

    Args:
        seed: seed of the first episodes. None: call `BaseWorld.reset` with a seed before the first step.
        autoreset: whether the next episode begins in the step that ends the last one.
        memories: names of what the world must remember of each episode.
    """
    Whole(1, MOST_ENVS).check(num_envs, "num_envs")
    settings: dict[str, Any] = {"seed": seed, "autoreset": autoreset, "threads": threads, "memories": memories}
    if (task := find_task(config.task)) is not None:
        return task.make_world(config, num_envs, **settings)
    from hierroom.worlds.escape_room.world import EscapeRoomWorld

    return EscapeRoomWorld(config, num_envs, **settings)
