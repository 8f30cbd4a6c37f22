"""EscapeRoom environments, exploration complexity and hierarchical PPO for goal-driven navigation.

Every function raises `InputError` for invalid input. Examples in docstrings assume ``import gymnasium``, ``import
hierroom`` and ``import numpy as np``.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from types import ModuleType
from typing import TYPE_CHECKING, Any

import gymnasium
import pettingzoo

if TYPE_CHECKING:
    from hierroom import complexity
    from hierroom.aec_env import env, raw_env
    from hierroom.goals import GoalGraph, GraphSpecs, Rules, enumerate_graphs
    from hierroom.lab.advise.advise import advise
    from hierroom.parallel_env import parallel_env
    from hierroom.runs.config.config import TrainConfig
    from hierroom.runs.config.presets import find_preset
    from hierroom.runs.minari import minari_dataset
    from hierroom.runs.rollout import rollout
    from hierroom.runs.trained_agent import TrainedAgent, load
    from hierroom.support.errors import InputError
    from hierroom.train import train
    from hierroom.worlds.env_config import EnvConfig
    from hierroom.worlds.task.task import Task
    from hierroom.worlds.workshop.task import workshop
    from hierroom.wrappers.boxes import box_view
    from hierroom.wrappers.features import add_features
    from hierroom.wrappers.minigrid import minigrid_view
    from hierroom.wrappers.sb3 import sb3_view

__all__ = ["EnvConfig", "GoalGraph", "InputError", "Rules", "Task", "TrainConfig", "TrainedAgent", "add_features"]
__all__ += ["advise", "box_view", "complexity", "enumerate_graphs", "env", "find_preset", "load", "minari_dataset"]
__all__ += ["minigrid_view", "parallel_env", "raw_env", "register", "rollout", "sb3_view", "train", "workshop"]
try:
    __version__ = version("hierroom")
except PackageNotFoundError:  # a copy of the source that is not installed
    __version__ = "unknown"

_LETTERS = tuple("abcdefg")
_HOMES = {
    "EnvConfig": "worlds.env_config",
    "GoalGraph": "goals",
    "InputError": "support.errors",
    "Rules": "goals",
    "Task": "worlds.task.task",
    "TrainConfig": "runs.config.config",
    "TrainedAgent": "runs.trained_agent",
    "add_features": "wrappers.features",
    "advise": "lab.advise.advise",
    "box_view": "wrappers.boxes",
    "enumerate_graphs": "goals",
    "env": "aec_env",
    "find_preset": "runs.config.presets",
    "load": "runs.trained_agent",
    "minari_dataset": "runs.minari",
    "minigrid_view": "wrappers.minigrid",
    "parallel_env": "parallel_env",
    "raw_env": "aec_env",
    "rollout": "runs.rollout",
    "sb3_view": "wrappers.sb3",
    "train": "train",
    "workshop": "worlds.workshop.task",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that commands do not wait for modules that they do not use."""
    if name in _HOMES:
        return getattr(importlib.import_module(f"hierroom.{_HOMES[name]}"), name)
    if name == "complexity":
        return importlib.import_module("hierroom.complexity")
    raise AttributeError(f"module 'hierroom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """The package. Its ``parallel_env`` is the class and its ``train`` the function, not the modules of these names."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        """Pickle by name, like other modules, so that cloudpickle can send functions that use the package."""
        return importlib.import_module, (self.__name__,)

    def __setattr__(self, name: str, value: Any) -> None:
        """Keep the import system from setting these two names to the modules."""
        if name not in ("parallel_env", "train"):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def register(name: str, graph: GraphSpecs, exclude: GraphSpecs = ()) -> str:
    """Register an id for a user's goal graphs with Gymnasium and PettingZoo: ``hierroom/EscapeRoom-NAME-v0``.

    Save this as ``my_rooms.py``; then ``gymnasium.make("my_rooms:hierroom/EscapeRoom-fork-v0")`` finds the graph in
    every process, and so does `gymnasium.make_vec`. `pettingzoo.make` finds it once the module is imported::

        import hierroom

        hierroom.register("fork", hierroom.GoalGraph(key_rooms=(0, 1, 1), exit_room=3, label="fork"))

    Args:
        name: letters, digits, ``_``, ``.`` and ``-``, but not the letter of one of the paper's graphs.
        graph: the graphs, in every form that environments take. Files are read now.
        exclude: graphs to leave out.

    Returns:
        the id. With it, `gymnasium.make` takes all other arguments of the environments.

    Examples:
        >>> hierroom.register("fork", hierroom.GoalGraph((0, 1, 1), exit_room=3))
        'hierroom/EscapeRoom-fork-v0'
        >>> gymnasium.make("hierroom/EscapeRoom-fork-v0", size=25).get_wrapper_attr("complexity").exit_depth
        4
    """
    from hierroom.goals import plain_specs
    from hierroom.support.errors import InputError

    if not isinstance(name, str) or not re.fullmatch(r"\w[\w.-]*", name, re.ASCII) or name in _LETTERS:
        raise InputError(
            "the name of an environment must be letters, digits, _, . and -, and not one of the letters "
            f"{', '.join(_LETTERS)}, which are the paper's graphs; not {name!r}"
        )
    kwargs = {"graph": plain_specs(graph), "exclude": plain_specs(exclude)}  # an EnvSpec can be written as JSON
    env_id = f"hierroom/EscapeRoom-{name}-v0"
    known = gymnasium.registry.get(env_id)
    if known is None or known.kwargs != kwargs:  # a module may be run twice; another graph overrides with a warning
        _register(env_id, kwargs)
    return env_id


def _register(env_id: str, kwargs: dict[str, Any]) -> None:
    gymnasium.register(
        env_id,
        entry_point="hierroom.gym_env:EscapeRoom",
        vector_entry_point="hierroom.vector_env:EscapeRooms",
        kwargs=kwargs,
    )
    if hasattr(pettingzoo, "EnvSpec"):  # since 1.27; its `register` would repeat Gymnasium's warning
        pettingzoo.aec_registry[env_id] = pettingzoo.EnvSpec(env_id, "hierroom.aec_env:env", kwargs)
        pettingzoo.parallel_registry[env_id] = pettingzoo.EnvSpec(env_id, "hierroom.parallel_env:parallel_env", kwargs)


_register("hierroom/EscapeRoom-v0", {})
_register("hierroom/Task-v0", {"task": ""})  # the user gives one
for _letter in _LETTERS:
    _register(f"hierroom/EscapeRoom-{_letter}-v0", {"graph": _letter})
_register("hierroom/Workshop-v0", {"task": "workshop:6"})
