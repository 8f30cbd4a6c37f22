"""A world of no EscapeRoom: corridors of cells in which goals stand; several may stand in one cell."""

from dataclasses import dataclass

import numpy as np
from gymnasium import spaces

from hierroom.goals.goal_set import GoalSet
from hierroom.worlds.world import OUTCOME_FIELDS, Feature

BACK, AHEAD = range(2)
STONE, LAMP, END = range(3)
CELL_OF = np.array([2, 2, 5])
"""The cell of each goal: stone and lamp are achieved in one step. The stone can be achieved again, the lamp once."""
OUTCOME = np.dtype((np.record, np.dtype([*OUTCOME_FIELDS], align=True)))


@dataclass(frozen=True, eq=False)
class CorridorView:
    """What M corridors show: the agent's cell, and which goals were achieved [M, 3]."""

    cells: np.ndarray
    achieved: np.ndarray

    def as_dict(self):
        return {"cell": self.cells.astype(np.int64)}

    def uniforms(self, turns, n):
        return np.full((len(self.cells), n), 0.5)

    def level(self, m, legal):
        return f"cell {self.cells[m]}, goals {np.flatnonzero(legal).tolist()}"

    @property
    def reachable(self):
        return ~self.achieved

    @property
    def depth_first_ranks(self):
        return CELL_OF + np.zeros((len(self.cells), 1), int)


class Corridor:
    """N corridors of six cells; the agent starts in cell 0, and the episode ends in the last one."""

    goals = GoalSet.one_hot(("stone", "lamp", "end"), "end")
    rules, variants, stage_titles, stage, complexity = None, ("corridor",), (), 0, None
    n_actions = 2
    features = {"cell": Feature((6,), lambda o: o.cells[:, None])}  # noqa: RUF012 - as the protocol has it
    observation_spaces = {"cell": spaces.Discrete(6)}  # noqa: RUF012
    has_begun, can_split = True, True

    def __init__(self, config, num_envs, *, seed=None, autoreset=True, threads=1, memories=()):
        self.config, self._autoreset = config, autoreset
        self.everywhere, self.outcomes = np.arange(num_envs), np.zeros(num_envs, OUTCOME)
        self.cells, self.steps = np.zeros((2, num_envs), int)
        self.achieved = np.zeros((num_envs, 3), bool)
        self._last = CorridorView(self.cells.copy(), self.achieved.copy())

    def __len__(self):
        return len(self.everywhere)

    def reset(self, seed=None, envs=slice(None)):
        self.cells[envs], self.steps[envs], self.achieved[envs] = 0, 0, False

    def as_actions(self, actions):
        return np.asarray(actions, np.int64)

    def step(self, actions):
        self.cells = np.clip(self.cells + np.where(actions == AHEAD, 1, -1), 0, 5)
        self.steps += 1
        now = self.cells[:, None] == CELL_OF
        now[:, LAMP] &= ~self.achieved[:, LAMP]
        self.outcomes["achieved"] = now @ (1 << np.arange(3))
        self.outcomes["n_first"] = (now & ~self.achieved).sum(axis=1)
        self.achieved |= now
        self.outcomes["terminated"], self.outcomes["length"] = now[:, END], self.steps
        self.outcomes["reward"] = now[:, END]
        self.outcomes["truncated"] = (self.steps == self.config.max_steps) & ~now[:, END]
        self._last = CorridorView(self.cells.copy(), self.achieved.copy())
        if self._autoreset:
            self.reset(envs=self.outcomes["terminated"] | self.outcomes["truncated"])
        return self.outcomes

    def observe(self, envs):
        return CorridorView(self.cells[envs], self.achieved[envs])

    exact_view = observe

    def last_view(self, envs, ended):
        now = self.observe(envs)
        return CorridorView(
            np.where(ended, self._last.cells[envs], now.cells),
            np.where(ended[:, None], self._last.achieved[envs], now.achieved),
        )

    def legal_goals(self, mask, are_turns, view=None):
        achieved = self.achieved if view is None else view.achieved
        legal = np.zeros((len(achieved), 4), bool)
        legal[:, :3] = are_turns[:, None] & ~achieved
        legal[:, 3] = ~legal.any(axis=1)
        return legal

    def variants_of(self, envs):
        return ["corridor"] * len(envs)

    def milestones_of(self, envs, goals):
        return goals

    def possible_milestones(self, variants):
        return [STONE, LAMP, END]

    def get_state(self, envs=slice(None)):
        return self.cells[envs].copy()

    def state_after(self, before, actions):
        return self._last.cells

    def get_arrays(self, envs):
        return {"cells": self.cells[envs].copy(), "steps": self.steps[envs].copy(), "has": self.achieved[envs].copy()}

    def check_arrays(self, arrays):
        pass

    def set_arrays(self, arrays):
        self.cells, self.steps, self.achieved = (arrays[name].copy() for name in ("cells", "steps", "has"))
