"""Tasks on which the preset ``task`` is searched. docs/others.md tests it on other ones, and has the command."""

import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np
from gymnasium.wrappers import TransformAction

import hierroom

_TORQUES = np.linspace(-2, 2, 5, dtype=np.float32)[:, None]


def _pendulum(render_mode: str | None = None) -> gymnasium.Env:
    env = gymnasium.make("Pendulum-v1", render_mode=render_mode)
    return TransformAction(env, lambda action: _TORQUES[action], gymnasium.spaces.Discrete(5))


pendulum = hierroom.Task(make=_pendulum)
frozen_lake = hierroom.Task(make="FrozenLake-v1")  # 4 x 4, slippery
crossing = hierroom.Task(make="MiniGrid-SimpleCrossingS9N1-v0")
key_corridor = hierroom.Task(make="MiniGrid-KeyCorridorS3R1-v0")
