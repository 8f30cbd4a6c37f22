"""Montezuma's Revenge by the 128 bytes of its memory: places, the key and the doors of the first room are the goals.

    pip install ale-py
    cd examples/tasks
    python -m hierroom train --task montezuma:montezuma --meta fixed-dfs --steps 30_000

In the episode evaluated then, the player comes to the ladder, the rope and the right end, and not yet to the key.

The bytes: 3 is the room, 42 and 43 are x and y of the player, 65 has a bit for a key in hand.
"""

from itertools import pairwise

import ale_py
import gymnasium

import hierroom

gymnasium.register_envs(ale_py)
ROOM, X, Y, ITEMS, KEY = 3, 42, 43, 65, 2
PLACES = {  # of the first room: the ranges of x and y
    "ladder": (range(70, 85), range(185, 200)),
    "rope": (range(105, 118), range(180, 225)),
    "right": (range(125, 150), range(185, 200)),
}


def memory(env):
    """Return the 128 bytes."""
    return env.unwrapped.ale.getRAM()


def is_at(place):
    """Return the goal to be at a place of the first room."""
    xs, ys = PLACES[place]

    def is_there(env, info):
        ram = memory(env)
        return ram[ROOM] == 1 and int(ram[X]) in xs and int(ram[Y]) in ys

    return is_there


def has_key(env, info):
    """Return whether the key is in hand."""
    return bool(memory(env)[ITEMS] & KEY)


def is_outside(env, info):
    """Return whether the player has left the first room."""
    return memory(env)[ROOM] != 1


GOALS = {**{place: is_at(place) for place in PLACES}, "key": has_key, "outside": is_outside}  # one after the other

montezuma = hierroom.Task(
    make=lambda render_mode=None: gymnasium.make("ALE/MontezumaRevenge-v5", obs_type="ram", render_mode=render_mode),
    goals=GOALS,
    rules={"ladder": {}, **{goal: {"needs": before} for before, goal in pairwise(GOALS)}},
    target="outside",
    max_steps=1000,
    label="Montezuma's Revenge",
)
