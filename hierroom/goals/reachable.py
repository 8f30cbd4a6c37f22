"""The goals that can be achieved, of many goal graphs at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def open_goals(
    key_rooms: NDArray[np.integer],
    exit_rooms: NDArray[np.integer],
    keys: NDArray[np.bool_],
    doors: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Find the goals that can be achieved now, [..., 2 B + 1] keys, doors, exit, for many graphs at once.

    Args:
        key_rooms: int, broadcast to the shape of ``doors``: the room in which the key of branch room 1, 2, ... B lies.
        exit_rooms: int, without the last dimension: the room that holds the exit.
        keys: [..., B] bool, whether the agent holds the key.
        doors: [..., B] bool, whether the door is open.
    """
    enterable = np.concatenate([np.ones((*doors.shape[:-1], 1), bool), doors], axis=-1)
    homes = np.broadcast_to(key_rooms, doors.shape)
    exits = np.broadcast_to(exit_rooms, doors.shape[:-1])[..., None]
    keys_in_reach = ~keys & ~doors & np.take_along_axis(enterable, homes, axis=-1)
    exit_in_reach = np.take_along_axis(enterable, exits, axis=-1)
    return np.concatenate([keys_in_reach, keys & ~doors, exit_in_reach], axis=-1)
