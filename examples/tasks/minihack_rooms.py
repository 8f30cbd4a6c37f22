"""MiniHack's KeyRoom: a key opens the door of the room with the stairs.

    pip install --no-deps nle minihack 'setuptools<82'
    cd examples/tasks
    python -m hierroom train --task minihack_rooms:key_room --meta fixed-dfs --steps 200_000

After 1,024 of these steps, the agent took the key in 62% of 50 evaluated episodes, opened the door in 40% and reached
the stairs in 12%. After 20,320 it had reached the stairs in 17% of training's episodes.
"""

import gymnasium
import minihack  # noqa: F401 - it registers its levels
import numpy as np
from nle import nethack

import hierroom

OPEN_DOORS = [nethack.GLYPH_CMAP_OFF + kind for kind in (12, 13, 14)]  # broken, and open to two sides


class Seeded(gymnasium.Wrapper):
    """NetHack ignores the seed of ``reset``; here this seed decides the episode, so that runs resume exactly."""

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        if seed is not None:
            self.unwrapped.seed(seed, seed, reseed=False)
        return self.env.reset(seed=seed, options=options)


def new_env():
    """Return the level, without Gymnasium's checks, which warn of each observation."""
    shown = ("chars_crop", "inv_oclasses")
    return Seeded(gymnasium.make("MiniHack-KeyRoom-S5-v0", observation_keys=shown, disable_env_checker=True))


def has_key(env, info):
    """Return whether a key is in the inventory."""
    return env.unwrapped.key_in_inventory("key") is not None


def is_door_open(env, info):
    """Return whether the level shows an open or broken door."""
    level = env.unwrapped
    return bool(np.isin(level.last_observation[level._glyph_index], OPEN_DOORS).any())


def is_downstairs(env, info):
    """Return whether the agent went to the stairs."""
    return info["end_status"] == env.unwrapped.StepStatus.TASK_SUCCESSFUL


key_room = hierroom.Task(
    make=new_env,
    goals={"key": has_key, "door": is_door_open, "stairs": is_downstairs},
    rules={"key": {}, "door": {"needs": "key"}, "stairs": {"needs": "door"}},
    target="stairs",
    max_steps=200,
    symbols=["chars_crop"],
    label="KeyRoom",
)
