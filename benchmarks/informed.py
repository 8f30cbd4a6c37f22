"""A controller that sees the whole level: with each goal it is given, as short as an agent can be."""

from __future__ import annotations

import numpy as np

from hierroom.goals import EXIT_GOAL, NO_GOAL
from hierroom.meta import MetaController, take_turn
from hierroom.turns.records import META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.oracle import shortest_actions


class Informed:
    """Goes the shortest way to each goal it is given, and to the exit without one.

    Args:
        meta: gives the goals; only such that can be reached.
        num_envs: how many environments it plays in.
    """

    def __init__(self, meta: MetaController, num_envs: int) -> None:
        self._meta = meta
        self._plans: list[list[int]] = [[] for _ in range(num_envs)]

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment."""
        due = turns.due(META)
        take_turn(self._meta, turns)
        for env in due:
            goal = EXIT_GOAL if turns.goals[env] == NO_GOAL else int(turns.goals[env])
            self._plans[env] = shortest_actions(turns.world.get_state([int(env)]), goal).tolist()
        return turns.step(np.array([plan.pop(0) for plan in self._plans]))
