"""EscapeRoom environments, exploration complexity and hierarchical PPO for goal-driven navigation."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from hierroom import complexity
    from hierroom.aec_env import env, raw_env
    from hierroom.env_config import EnvConfig
    from hierroom.errors import InputError
    from hierroom.goals import GoalGraph, enumerate_graphs
    from hierroom.parallel_env import parallel_env
    from hierroom.train import train
    from hierroom.training.config import TrainConfig
    from hierroom.training.presets import find_preset
    from hierroom.training.rollout import rollout
    from hierroom.training.trained_agent import TrainedAgent, load
    from hierroom.wrappers import add_features, box_view

__all__ = [
    "EnvConfig",
    "GoalGraph",
    "InputError",
    "TrainConfig",
    "TrainedAgent",
    "add_features",
    "box_view",
    "complexity",
    "enumerate_graphs",
    "env",
    "find_preset",
    "load",
    "parallel_env",
    "raw_env",
    "rollout",
    "train",
]
__version__ = "0.1.0"

_HOMES = {
    "EnvConfig": "env_config",
    "GoalGraph": "goals",
    "InputError": "errors",
    "TrainConfig": "training.config",
    "TrainedAgent": "training.trained_agent",
    "add_features": "wrappers",
    "box_view": "wrappers",
    "enumerate_graphs": "goals",
    "env": "aec_env",
    "find_preset": "training.presets",
    "load": "training.trained_agent",
    "parallel_env": "parallel_env",
    "raw_env": "aec_env",
    "rollout": "training.rollout",
    "train": "train",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for: a command must not wait for what it does not use."""
    if name in _HOMES:
        return getattr(importlib.import_module(f"hierroom.{_HOMES[name]}"), name)
    if name == "complexity":
        return importlib.import_module("hierroom.complexity")
    raise AttributeError(f"module 'hierroom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """The package, in which ``parallel_env`` is the class and ``train`` the function, not the files of these names."""

    @property
    def parallel_env(self) -> type:
        return __getattr__("parallel_env")

    @parallel_env.setter
    def parallel_env(self, module: ModuleType) -> None:
        """Keep the import system from putting the file there."""

    @property
    def train(self) -> Callable[..., Any]:
        return __getattr__("train")

    @train.setter
    def train(self, module: ModuleType) -> None:
        """Likewise."""


sys.modules[__name__].__class__ = _Package

for _id, _kwargs in {"EscapeRoom": {}, **{f"EscapeRoom-{letter}": {"graph": letter} for letter in "abcdefg"}}.items():
    gymnasium.register(
        f"hierroom/{_id}-v0",
        entry_point="hierroom.gym_env:EscapeRoom",
        vector_entry_point="hierroom.gym_env:EscapeRooms",
        kwargs=_kwargs,
    )
