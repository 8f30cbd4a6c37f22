"""Breadth-first search over the real rules of an EscapeRoom, with no knowledge of them."""

import numpy as np

from hierroom.worlds.escape_room.batch_kernels import step_levels
from hierroom.worlds.escape_room.layout import OUTCOME, State

FIELDS = ("row", "col", "direction", "keys", "doors", "bag", "bag_size")


def steps_to_goals(state: State, can_drop: bool) -> dict[int, int]:
    """Fewest steps from one environment's state to each goal that can be achieved."""
    frontier = state.copy()
    frontier.levels["can_drop"], frontier.levels["steps"], frontier.levels["max_steps"] = can_drop, 0, 2**31 - 1
    actions = np.arange(6 if can_drop else 5)
    seen, found, distance = set(), {}, 0
    while len(frontier):
        distance += 1
        after = frontier[np.repeat(np.arange(len(frontier)), len(actions))]
        outcomes = np.zeros(len(after), OUTCOME)
        step_levels(after.levels, after.grids, np.tile(actions, len(frontier)), outcomes)
        for achieved in np.unique(outcomes["achieved"]).tolist():
            if achieved:
                found.setdefault(achieved.bit_length() - 1, distance)
        new = []
        for n in np.flatnonzero(~outcomes["terminated"]).tolist():
            level = after.levels[n]
            identity = (after.grids[n].tobytes(), *(level[name].tobytes() for name in FIELDS))
            if identity not in seen:
                seen.add(identity)
                new.append(n)
        frontier = after[new]
    return found
