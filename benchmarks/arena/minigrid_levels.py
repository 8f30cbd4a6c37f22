"""MiniGrid's and BabyAI's levels, other than the three that the measure was tried on before it was chosen.

One thing can be carried at a time, so a key has to be dropped before something else is picked up. Missions are texts,
which agents do not see, so all levels have one mission only.
"""

from functools import partial
from itertools import pairwise

import gymnasium
import minigrid  # noqa: F401 - it registers its levels
from minigrid.core.world_object import Door, Goal, Key

import hierroom
from examples.tasks.minigrid_levels import holds


def things(env, kind):
    """Return the things of a kind in the grid."""
    return [thing for thing in env.unwrapped.grid.grid if isinstance(thing, kind)]


def n_locked(env):
    """Return how many doors are locked."""
    return sum(door.is_locked for door in things(env, Door))


def opens(n, env, info):
    """Return whether n doors are open."""
    return sum(door.is_open for door in things(env, Door)) >= n


def unlocks(left, env, info):
    """Return whether at most some doors are locked."""
    return n_locked(env) <= left


def drops(left, env, info):
    """Return whether nothing is carried, and at most some doors are locked."""
    return env.unwrapped.carrying is None and n_locked(env) <= left


def takes_key(env, info):
    """Return whether the key of a locked door is carried."""
    held = env.unwrapped.carrying
    colours = {door.color for door in things(env, Door) if door.is_locked}
    return isinstance(held, Key) and held.color in colours


def takes_last_key(env, info):
    """Return whether the key of the last locked door is carried."""
    return n_locked(env) == 1 and takes_key(env, info)


def takes_target(env, info):
    """Return whether the thing that the mission asks for is carried."""
    return env.unwrapped.carrying is env.unwrapped.obj


def opens_box(env, info):
    """Return whether the key is out of its box."""
    return bool(things(env, Key)) or isinstance(env.unwrapped.carrying, Key) or n_locked(env) == 0


def is_home(env, info):
    """Return whether the agent is on the goal's cell."""
    level = env.unwrapped
    return isinstance(level.grid.get(*level.agent_pos), Goal)


def level(name, goals, max_steps, *, actions=7):
    """Return the task of a level.

    Args:
        name: its id.
        goals: what to achieve, in order; the last one is the target.
        max_steps: of an episode.
        actions: 7, or 5: without those that drop and end.
    """
    order = [*goals]
    rules = {order[0]: {}} | {goal: {"needs": before} for before, goal in pairwise(order)}

    def make(render_mode=None):
        env = gymnasium.make(name, render_mode=render_mode, max_steps=max_steps)
        if actions == 5:
            few = [0, 1, 2, 3, 5]
            env = gymnasium.wrappers.TransformAction(env, lambda action: few[action], gymnasium.spaces.Discrete(5))
        return env

    return hierroom.Task(make, goals, rules, order[-1], max_steps)


LOCKED_DOOR = {"key": takes_key, "unlock": partial(unlocks, 0)}
_FETCH = {**LOCKED_DOOR, "drop": partial(drops, 0), "ball": takes_target}
KEY_ROOM = {"key": takes_key, "door": partial(opens, 1), "home": is_home}
_TWICE = {
    **{"key 1": takes_key, "unlock 1": partial(unlocks, 1), "drop 1": partial(drops, 1)},
    **{"key 2": takes_last_key, "unlock 2": partial(unlocks, 0), "drop 2": partial(drops, 0), "ball": holds("ball")},
}
TASKS = {
    "door_key_6": level("MiniGrid-DoorKey-6x6-v0", KEY_ROOM, 360),
    "door_key_8": level("MiniGrid-DoorKey-8x8-v0", KEY_ROOM, 360, actions=5),
    "unlock": level("MiniGrid-Unlock-v0", LOCKED_DOOR, 150, actions=5),
    "multi_room_2": level("MiniGrid-MultiRoom-N2-S4-v0", {"door": partial(opens, 1), "home": is_home}, 100),
    "multi_room_4": level(
        "MiniGrid-MultiRoom-N4-S5-v0", {f"door {n}": partial(opens, n) for n in (1, 2, 3)} | {"home": is_home}, 240
    ),
    "key_corridor": level("MiniGrid-KeyCorridorS3R2-v0", {"door": partial(opens, 1), **_FETCH}, 270),
    "key_in_box": level("BabyAI-KeyInBox-v0", {"box": opens_box, **LOCKED_DOOR}, 300),
    "unlock_to_unlock": level("BabyAI-UnlockToUnlock-v0", _TWICE, 1000),
    "obstructed": level("MiniGrid-ObstructedMaze-1Dl-v0", _FETCH, 288),
    "obstructed_box": level("MiniGrid-ObstructedMaze-1Dlh-v0", {"box": opens_box, **_FETCH}, 500),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.minigrid_levels:unlock
