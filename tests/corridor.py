"""A world that is no EscapeRoom: corridors of cells with goals, of which a cell may have several."""

import numpy as np
from gymnasium import spaces

from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules
from hierroom.worlds.base import BaseWorld
from hierroom.worlds.base_view import goal_status
from hierroom.worlds.world import Feature

BACK, AHEAD = range(2)
STONE, LAMP, END = range(3)
CELL_OF = np.array([2, 2, 5])
"""The cell of each goal: stone and lamp are achieved in one step. The stone can be achieved again, the lamp once."""


class Corridor(BaseWorld):
    """N corridors of six cells; the agent starts in cell 0, and the episode ends in the last one."""

    goals = GoalSet.one_hot(("stone", "lamp", "end"), "end")
    n_actions = 2
    features = {  # noqa: RUF012 - as the protocol has it
        "cell": Feature((6,), lambda o: o.entries["cell"][:, None]),
        "goal-status": goal_status(3),
    }
    observation_spaces = {"cell": spaces.Discrete(6)}  # noqa: RUF012 - as the protocol has it
    rules = Rules({name: {"gives": name} for name in ("stone", "lamp", "end")}, "end")
    can_split = True

    def __init__(self, config, num_envs, **settings):
        self.cells = np.zeros(num_envs, np.int64)
        super().__init__(config, num_envs, **settings)

    def begin(self, envs):
        self.cells[envs] = 0

    def shown(self, envs):
        return {"cell": self.cells[envs]}

    def step(self, actions):
        self.cells = np.clip(self.cells + np.where(actions == AHEAD, 1, -1), 0, 5)
        now = self.cells[:, None] == CELL_OF
        now[:, LAMP] &= self.counts[:, LAMP] == 0
        return self.record(now, now[:, END], now[:, END])

    def get_arrays(self, envs):
        return {**super().get_arrays(envs), "cells": self.cells[envs]}

    def set_arrays(self, arrays):
        super().set_arrays(arrays)
        self.cells = arrays["cells"].copy()


class CorridorTask:
    """The task that a config names for environments that are corridors."""

    name, max_steps = "corridor", 1000
    goal_set, n_actions, features = Corridor.goals, Corridor.n_actions, Corridor.features
    controller_features, meta_features = ("cell", "symbol", "previous-action"), ("goal-status", "goal-outcome")
    make_world = staticmethod(Corridor)
