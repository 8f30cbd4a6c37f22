"""A game without its window: one level after the other, played by a person or a trained agent that takes over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium

from hierroom.goals import COLOURS, NO_GOAL, GoalGraph
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.worlds.escape_room.constants import COL_STEP, KEY, LOCKED_DOOR, OPEN, OPEN_DOOR, PICKUP, ROW_STEP
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.level import goal_name
from hierroom.worlds.escape_room.render import seen_cells
from hierroom.worlds.escape_room.replayer import ACTION_NAMES


class Game:
    """Levels that are played step by step.

    Args:
        make: makes the environment of a level, whose observations have the features of the agent.
        agent: a trained agent that can take over; it acts at every step, so that it remembers those of the person.
        seed: of the first level; each later one has the next seed.

    Attributes:
        message: the effect of the last step, or the reason why it had none.
        seen: [size, size] bool, the cells that have been in view.
    """

    def __init__(self, make: Callable[[], gymnasium.Env], agent: TrainedAgent | None = None, seed: int = 0) -> None:
        self._make, self.agent = make, agent
        self.is_piloted = self.has_fog = self.has_hints = False
        self.begin(seed)

    def begin(self, seed: int) -> None:
        """Begin a level."""
        self.seed, self._env, self._memory = seed % 2**63, self._make(), None
        self._turns: Any = self._env.unwrapped.single.turns  # pyright: ignore[reportAttributeAccessIssue] - of hierroom
        self._observation, info = self._env.reset(seed=self.seed)
        self.graph: GoalGraph = self._turns.world.graph_of(self.state)
        self.shortest, self.seen = info["shortest_length"], seen_cells(self.state)
        self.message, self.has_ended, self.has_escaped = "", False, False

    @property
    def state(self) -> State:
        """A copy of the level's state."""
        return self._turns.world.get_state()

    @property
    def goal(self) -> int:
        """The goal id that the agent's meta-controller pursues now; -1 for none."""
        return int(self._turns.goals[0])

    @property
    def hint(self) -> str:
        """The oracle's next action, and the number of actions to the exit, in words."""
        if self.has_ended:
            return "none, the level has ended"
        plan = self._turns.world.shortest_actions(0)
        return f"{ACTION_NAMES[int(plan[0])]} ({len(plan)} to the exit)"

    def name_of(self, goal: int) -> str:
        """Return the name of a goal of the level, such as ``"red key 1"``."""
        return goal_name(self.state.levels[0], goal)

    def step(self, action: int | None = None) -> None:
        """Take a step with the person's action, or if None with the agent's, unless the level has ended."""
        if self.has_ended:
            self.message = "the level has ended: n begins the next one, r this one again"
            return
        own = None
        if self.agent is not None:
            own, self._memory = self.agent.act(self._observation, self._memory, seed=self.seed)
        self._observation, _, terminated, truncated, info = self._env.step(own if action is None else action)
        self.has_escaped, self.has_ended = terminated, terminated or truncated
        event, n = info["goal_event"], info["length"]
        self.seen |= seen_cells(self.state)
        self.message = "" if event == NO_GOAL else f"{self.name_of(event)}!"
        if self.has_ended:
            self.message = f"escaped in {n} steps" if terminated else f"the limit of {n} steps is reached"

    def use(self) -> None:
        """Pick up or open the object in front; if impossible, take no step and set a message with the reason."""
        level = self.state.levels[0]
        tile = int(self.state.grids[0, level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]])
        if KEY <= tile < OPEN_DOOR:
            self.step(PICKUP)
        elif not LOCKED_DOOR <= tile < LOCKED_DOOR + len(COLOURS):
            self.message = "there is neither a key nor a locked door in front"
        elif level.keys >> level.branches[tile - LOCKED_DOOR] & 1:
            self.step(OPEN)
        else:
            self.message = f"this door needs {self.name_of(tile - LOCKED_DOOR)}"
