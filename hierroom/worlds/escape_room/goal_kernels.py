"""Kernels that write the goals a meta-controller may choose in a level."""

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_GOALS
from hierroom.support.kernel import njit

REACHABLE, EXISTING, SEEN, ALL = range(4)
GOAL_MASKS = {"reachable": REACHABLE, "existing": EXISTING, "seen": SEEN, "none": ALL}
"""Legal goals by name. reachable: can be achieved before any other; existing: in the level and not achieved yet; seen:
existing, and seen this episode; none: all goal ids, even absent ones. Under ``seen``, 'no goal' (find something new) is
always legal, because what matters may still be unseen."""


@njit(cache=True)
def write_goals(level, kind, goals):
    """Write which goals [13] a meta-controller may choose in a level on its turn; return whether there is one."""
    if kind == ALL:
        goals[:N_GOALS] = True
        return True
    goals[:N_GOALS] = False
    n_legal = 0
    for branch in range(level.n_rooms - 1):
        colour = level.colours[branch]
        is_held, is_open = level.keys >> branch & 1, level.doors >> branch & 1
        if kind == REACHABLE:
            home = level.key_rooms[branch]
            key_legal = (home == 0 or level.doors >> (home - 1) & 1) and not is_held and not is_open
            door_legal = is_held and not is_open
        else:
            key_legal, door_legal = not is_open and not is_held, not is_open
            if kind == SEEN:
                key_legal = key_legal and level.seen >> colour & 1
                door_legal = door_legal and level.seen >> (FIRST_DOOR_GOAL + colour) & 1
        if key_legal:
            goals[colour] = True
            n_legal += 1
        if door_legal:
            goals[FIRST_DOOR_GOAL + colour] = True
            n_legal += 1
    if kind == REACHABLE:
        exit_legal = level.doors >> (level.exit_room - 1) & 1
    else:
        exit_legal = kind == EXISTING or level.seen >> EXIT_GOAL & 1
    if exit_legal:
        goals[EXIT_GOAL] = True
        n_legal += 1
    return n_legal > 0


@njit(cache=True, nogil=True)
def write_masks(levels, are_turns, kind, masks):
    """Write the legal choices [M, 14] of meta-controllers.

    'No goal' is legal where no goal is, such as off turn, and under ``SEEN`` always.
    """
    for m in range(levels.shape[0]):
        has_goal = False
        if are_turns[m]:
            has_goal = write_goals(levels[m], kind, masks[m])
        else:
            masks[m, :N_GOALS] = False
        masks[m, N_GOALS] = not has_goal or kind == SEEN
