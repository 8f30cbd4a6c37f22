"""Three levels of MiniGrid as tasks: ``python -m hierroom train --task minigrid_levels:unlock_pickup``.

One thing can be carried at a time. So the key has to be dropped before something else is picked up, and this is a goal
like the others. The rules say what the levels enforce, and no more: which door hides the key is for the agent to find.
"""

import minigrid  # noqa: F401 - it registers its levels
from minigrid.core.world_object import Door

import hierroom


def holds(kind):
    """Return the goal to carry a thing of some kind."""

    def is_held(env, info):
        thing = env.unwrapped.carrying
        return thing is not None and thing.type == kind

    return is_held


def is_unlocked(env, info):
    """Return whether the locked door was unlocked, which nothing reverses."""
    return not any(door.is_locked for door in _doors(env))


def is_key_dropped(env, info):
    """Return whether the door is unlocked and nothing is carried."""
    return env.unwrapped.carrying is None and is_unlocked(env, info)


def is_ball_moved(env, info):
    """Return whether the ball is put down elsewhere than in front of the locked door."""
    level = env.unwrapped
    x, y = level.get_room(0, 0).doors[0].cur_pos
    return level.grid.get(x - 1, y) is None and not holds("ball")(env, info)


def is_some_door_open(env, info):
    """Return whether a door is open."""
    return any(door.is_open for door in _doors(env))


def _doors(env):
    rooms = [room for row in env.unwrapped.room_grid for room in row]
    return [door for room in rooms for door in room.doors if isinstance(door, Door)]


unlock_pickup = hierroom.Task(
    make="MiniGrid-UnlockPickup-v0",
    goals={"key": holds("key"), "unlock": is_unlocked, "drop": is_key_dropped, "box": holds("box")},
    rules={"key": {}, "unlock": {"needs": "key"}, "drop": {"needs": "unlock"}, "box": {"needs": "drop"}},
    target="box",
    max_steps=288,
    label="UnlockPickup",
)

blocked_unlock_pickup = hierroom.Task(
    make="MiniGrid-BlockedUnlockPickup-v0",
    goals={
        "ball": is_ball_moved,
        "key": holds("key"),
        "unlock": is_unlocked,
        "drop": is_key_dropped,
        "box": holds("box"),
    },
    rules={
        "ball": {},
        "key": {},
        "unlock": {"needs": ["ball", "key"]},
        "drop": {"needs": "unlock"},
        "box": {"needs": "drop"},
    },
    target="box",
    max_steps=576,
    label="BlockedUnlockPickup",
)

key_corridor = hierroom.Task(
    make="MiniGrid-KeyCorridorS3R3-v0",
    goals={
        "door": is_some_door_open,
        "key": holds("key"),
        "unlock": is_unlocked,
        "drop": is_key_dropped,
        "ball": holds("ball"),
    },
    rules={
        "door": {},
        "key": {"needs": "door"},
        "unlock": {"needs": "key"},
        "drop": {"needs": "unlock"},
        "ball": {"needs": "drop"},
    },
    target="ball",
    max_steps=270,
    label="KeyCorridorS3R3",
)
