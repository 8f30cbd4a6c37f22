"""Tasks that nobody here wrote, with their steps, thresholds and settings, for `benchmarks.others`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import TransformReward

METHODS = ("hierroom", "hippo", "ppo", "recurrent-ppo")
_CLASSIC = {"n_steps": 256, "batch_size": 64, "n_epochs": 4, "gae_lambda": 0.94, "num_envs": 16, "normalize": True}
_TABLE = {"n_steps": 128, "batch_size": 256, "n_epochs": 4, "learning_rate": 1e-3, "ent_coef": 0.01}
_MINIGRID = {"n_steps": 128, "batch_size": 64, "n_epochs": 10, "learning_rate": 2.5e-4, "ent_coef": 0.01}


@dataclass(frozen=True)
class Other:
    """A task that somebody else wrote, and what a run needs to know.

    Args:
        id: the id of the environment.
        steps: primitive steps of a run.
        threshold: the score that counts as learned.
        settings: those of Stable-Baselines3, with the number of environments and whether `VecNormalize` scales.
        factor: multiplies the rewards; scores are of the rewards without it.
        by_success: whether the score is the share of episodes with a return above 0.
        options: arguments of the environment.
        goals: returns the goals of HiPPO, each of which needs the one before it; None if it does not take part.
    """

    id: str
    steps: int
    threshold: float
    settings: Mapping[str, Any]
    factor: float = 1.0
    by_success: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)
    goals: Callable[[], Mapping[str, Any]] | None = None

    @property
    def methods(self) -> tuple[str, ...]:
        """Return the methods that take part."""
        return tuple(method for method in METHODS if self.goals or method != "hippo")

    def make(self, render_mode: str | None = None) -> gymnasium.Env:
        """Return a new environment."""
        if self.id.startswith("MiniGrid"):
            import minigrid  # noqa: F401 - it registers its environments
        if self.id.startswith("PointMaze"):
            import gymnasium_robotics  # pyright: ignore[reportMissingImports]

            gymnasium.register_envs(gymnasium_robotics)
        env = gymnasium.make(self.id, render_mode=render_mode, **self.options)
        return env if self.factor == 1 else TransformReward(env, lambda reward: self.factor * float(reward))

    def score(self, returns: np.ndarray) -> np.ndarray:
        """Return the score of each episode [E] from its return."""
        return (returns > 0).astype(float) if self.by_success else returns / self.factor


def _annealed(start: float) -> Callable[[float], float]:
    return lambda left: start * left


_CARTPOLE = {
    **{"n_steps": 32, "batch_size": 256, "n_epochs": 20, "gamma": 0.98, "gae_lambda": 0.8},
    **{"learning_rate": _annealed(1e-3), "clip_range": _annealed(0.2)},
}


def _key_room() -> Mapping[str, Any]:
    from benchmarks.arena.minigrid_levels import KEY_ROOM

    return KEY_ROOM


def _locked_door() -> Mapping[str, Any]:
    from benchmarks.arena.minigrid_levels import LOCKED_DOOR

    return LOCKED_DOOR


def _bends() -> Mapping[str, Any]:
    def is_near(place: tuple[float, float], env: gymnasium.Env, info: Mapping[str, Any]) -> bool:
        ball = env.unwrapped.point_env.data.qpos[:2]  # pyright: ignore[reportAttributeAccessIssue]
        return bool(np.linalg.norm(ball - place) <= 0.5)

    bends = {"first bend": partial(is_near, (1, 1)), "second bend": partial(is_near, (1, -1))}
    return {**bends, "end": lambda env, info: bool(info.get("success"))}


_FROZEN = {"map_name": "8x8", "is_slippery": False}
_PENDULUM = {
    **{"n_steps": 1024, "n_epochs": 10, "gamma": 0.9, "learning_rate": 1e-3, "num_envs": 4},
    **{"use_sde": True, "sde_sample_freq": 4},
}
_CONTINUOUS_CAR = {
    **{"n_steps": 8, "batch_size": 256, "n_epochs": 10, "gamma": 0.9999, "gae_lambda": 0.9, "num_envs": 1},
    **{"learning_rate": 7.77e-5, "clip_range": 0.1, "ent_coef": 0.00429, "vf_coef": 0.19, "max_grad_norm": 5},
    **{"use_sde": True, "normalize": True, "policy_kwargs": {"log_std_init": -3.29, "ortho_init": False}},
}
_FORCES = {"n_steps": 512, "batch_size": 64, "n_epochs": 10, "gae_lambda": 0.95, "normalize": True}
_BENDS = [[1] * 5, [1, "r", 0, 0, 1], [1, 1, 1, 0, 1], [1, "g", 0, 0, 1], [1] * 5]  # from r to g
_MAZE = {"maze_map": _BENDS, "max_episode_steps": 300}
TASKS: Mapping[str, Other] = {
    "CartPole": Other("CartPole-v1", 100_000, 400, _CARTPOLE),
    "Acrobot": Other("Acrobot-v1", 100_000, -100, _CLASSIC),
    "MountainCar": Other("MountainCar-v0", 200_000, -150, {**_CLASSIC, "n_steps": 16, "gae_lambda": 0.98}),
    "Pendulum": Other("Pendulum-v1", 100_000, -200, _PENDULUM),
    "MountainCarContinuous": Other("MountainCarContinuous-v0", 100_000, 90, _CONTINUOUS_CAR),
    "PointMaze dense": Other("PointMaze_UMazeDense-v3", 100_000, 150, _FORCES, options=_MAZE),
    "PointMaze": Other(
        *("PointMaze_UMaze-v3", 100_000, 0.9, _FORCES),
        **{"by_success": True, "options": {**_MAZE, "continuing_task": False}, "goals": _bends},
    ),
    "FrozenLake": Other("FrozenLake-v1", 100_000, 0.9, _TABLE, by_success=True, options=_FROZEN),
    "FrozenLake x 0.01": Other("FrozenLake-v1", 100_000, 0.9, _TABLE, 0.01, by_success=True, options=_FROZEN),
    "FrozenLake x 100": Other("FrozenLake-v1", 100_000, 0.9, _TABLE, 100.0, by_success=True, options=_FROZEN),
    "CliffWalking": Other("CliffWalking-v1", 100_000, -30, _TABLE, options={"max_episode_steps": 200}),
    "Taxi": Other("Taxi-v4", 200_000, 0, _TABLE),
    "Empty-8x8": Other("MiniGrid-Empty-8x8-v0", 60_000, 0.9, _MINIGRID, by_success=True),
    "DoorKey-5x5": Other("MiniGrid-DoorKey-5x5-v0", 100_000, 0.9, _MINIGRID, by_success=True, goals=_key_room),
    "DoorKey-6x6": Other("MiniGrid-DoorKey-6x6-v0", 150_000, 0.9, _MINIGRID, by_success=True, goals=_key_room),
    "LavaGap-S5": Other("MiniGrid-LavaGapS5-v0", 100_000, 0.9, _MINIGRID, by_success=True),
    "Unlock": Other("MiniGrid-Unlock-v0", 100_000, 0.9, _MINIGRID, by_success=True, goals=_locked_door),
    "MemoryS7": Other("MiniGrid-MemoryS7-v0", 150_000, 0.9, _MINIGRID, by_success=True),
}
