"""MiniHack: keys, doors, stairs and things to use, on levels of NetHack.

    pip install --no-deps nle minihack 'setuptools<82'

NLE 1.3 asks for Gymnasium 1.2 and works with 1.4. MiniHack's MultiRoom does not: it seeds MiniGrid as Gym once did.
"""

from functools import partial
from itertools import pairwise

import gymnasium
import minihack  # noqa: F401 - it registers its levels
from nle.nethack import Command, CompassDirection

import hierroom
from examples.tasks.minihack_rooms import Seeded, has_key, is_door_open, is_downstairs

_SHOWN = ("chars_crop", "inv_oclasses")
_MOVES = tuple(CompassDirection)
_FIRST_FREE = Command.FIRE
"""The key f, which is also the letter of the first thing that is picked up."""


def carries(name, env, info):
    """Return whether a thing is in the inventory."""
    return env.unwrapped.key_in_inventory(name) is not None


def stands_on(symbol, env, info):
    """Return whether the level shows no such symbol any more, because the agent stands on it, or has it."""
    level = env.unwrapped
    return ord(symbol) not in level.last_observation[level._observation_keys.index("chars")]


def level(name, goals, max_steps, actions=None):
    """Return the task of a level, whose goals are achieved one after the other.

    Args:
        name: its id, without MiniHack and version.
        goals: what to do; the last one ends the episode.
        max_steps: of an episode.
        actions: keys; None: those of the level.
    """
    order = [*goals]
    own = {"observation_keys": _SHOWN, "max_episode_steps": max_steps, "disable_env_checker": True}
    own |= {} if actions is None else {"actions": actions}

    def make():
        env = gymnasium.make(f"MiniHack-{name}-v0", **own)
        env.unwrapped._max_episode_steps = max_steps  # NetHack's own limit, which make does not pass on
        return Seeded(env)

    rules = {goal: {"needs": before} for before, goal in pairwise(order)}
    return hierroom.Task(make, goals, {order[0]: {}} | rules, order[-1], max_steps, symbols=["chars_crop"])


def use(symbol, thing, key):
    """Return the goals, and the actions, to pick a thing up and to use it."""
    goals = {"find": partial(stands_on, symbol), "take": partial(carries, thing), "use": is_downstairs}
    return {"goals": goals, "actions": (*_MOVES, Command.PICKUP, key, _FIRST_FREE)}


_ROOM = {"key": has_key, "door": is_door_open, "stairs": is_downstairs}
_ROOMS = {"door": is_door_open, "stairs": is_downstairs}
_EAT = {"find": partial(stands_on, "%"), "eat": is_downstairs}
TASKS = {
    "key_room_fixed": level("KeyRoom-Fixed-S5", _ROOM, 200),
    "key_room": level("KeyRoom-S5", _ROOM, 500),
    "key_room_dark": level("KeyRoom-Dark-S5", _ROOM, 300),
    "key_room_15": level("KeyRoom-S15", _ROOM, 400),
    "closed_door": level("ClosedDoor", _ROOMS, 200, _MOVES),
    "locked_door": level("LockedDoor", _ROOMS, 500, (*_MOVES, Command.KICK)),
    "eat": level("Eat", _EAT, 250, (*_MOVES, Command.EAT)),
    "wield": level("Wield", max_steps=250, **use(")", "dagger", Command.WIELD)),
    "put_on": level("PutOn", max_steps=500, **use('"', "amulet", Command.PUTON)),
    "zap": level("Zap", max_steps=400, **use("/", "wand", Command.ZAP)),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.minihack_rooms:eat
