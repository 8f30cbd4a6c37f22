"""A game without its drawing: one level after the other, played by a person or a trained agent that takes over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS, EXIT_GOAL, NO_GOAL, GoalGraph
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.constants import COL_STEP, KEY, LOCKED_DOOR, OPEN, OPEN_DOOR, PICKUP, ROW_STEP
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.level import goal_name
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.render import seen_cells
from hierroom.worlds.escape_room.replayer import ACTION_NAMES


class Game:
    """The levels of one environment, played step by step; a trained agent observes all steps, so that it can take over.

    Args:
        turns: one environment without autoreset, with measured shortest lengths.
        agent: a trained agent that can take over, and that made the ``turns``; None: no agent.

    Attributes:
        message: the effect of the last step, or the reason why it had none.
        achieved: the goal ids achieved in this level, in order.
        seen: [size, size] bool, the cells that have been in view.
    """

    def __init__(self, turns: Turns, agent: TrainedAgent | None = None, seed: int = 0) -> None:
        self.turns = turns
        self.is_piloted = self.has_fog = self.has_hints = False
        self.agent, self._seed = agent, seed
        self._begin()

    def _begin(self) -> None:
        self._start = self.turns.get_state()
        self._pair = self.agent.pair(1, seed=self._seed) if self.agent is not None else None
        state = self.state
        self.graph: GoalGraph = self.turns.world.graph_of(state)
        self.shortest = int(self.turns.ledger.shortest[0])
        self.message, self.achieved, self.has_ended, self.has_escaped = "", [], False, False
        self.seen: NDArray[np.bool_] = seen_cells(state)
        if self._pair is not None:
            self._pair.choose(self.turns, META)

    @property
    def state(self) -> State:
        """A copy of the level's state."""
        return self.turns.world.get_state()

    @property
    def goal(self) -> int:
        """The goal id that the agent's meta-controller would pursue now; -1 for none."""
        return int(self.turns.goals[0])

    @property
    def hint(self) -> str:
        """The oracle's next action, and the number of actions to the exit, in words."""
        if self.has_ended:
            return "none, the level has ended"
        plan = shortest_actions(self.state)
        return f"{ACTION_NAMES[int(plan[0])]} ({len(plan)} to the exit)"

    def name_of(self, goal: int) -> str:
        """Return the name of a goal of the level, such as ``"red key 1"``."""
        return goal_name(self.state.levels[0], goal)

    def step(self, action: int | None = None) -> None:
        """Take a step with the person's action, or if None with the agent's, unless the level has ended."""
        if self.has_ended:
            self.message = "the level has ended: n begins the next one, r this one again"
            return
        if self._pair is None:
            if action is None:
                raise InputError("there is no agent to play")
            step = self.turns.step(np.array([action]))
        else:
            self._pair.choose(self.turns, CONTROLLER)
            if action is not None:
                self.turns.act(CONTROLLER, self.turns.observe(CONTROLLER, np.arange(1)), [action])
            step = self.turns.advance()
            for agent in self._pair.agents.values():
                agent.record(step, self.turns)
            if not step.episode_ended[0]:
                self._pair.choose(self.turns, META)
        self.has_ended, self.has_escaped = bool(step.episode_ended[0]), bool(step.terminated[0])
        self.message, event = "", int(step.events[0])
        self.seen |= seen_cells(self.state)
        if event != NO_GOAL:
            self.achieved.append(event)
            self.message = f"{self.name_of(event)}!" if event != EXIT_GOAL else ""
        if self.has_ended:
            n = int(step.lengths[0])
            self.message = f"escaped in {n} steps" if self.has_escaped else f"the limit of {n} steps is reached"

    def use(self) -> None:
        """Pick up or open the object in front; if impossible, take no step and set a message with the reason."""
        self.is_piloted = False
        level = self.state.levels[0]
        row, col = level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]
        tile = int(self.state.grids[0, row, col])
        if KEY <= tile < OPEN_DOOR:
            self.step(PICKUP)
        elif tile >= LOCKED_DOOR and tile - LOCKED_DOOR < len(COLOURS):
            branch = int(level.branches[tile - LOCKED_DOOR])
            if int(level.keys) >> branch & 1:
                self.step(OPEN)
            else:
                self.message = f"this door needs {self.name_of(tile - LOCKED_DOOR)}"
        else:
            self.message = "there is neither a key nor a locked door in front"

    def next_level(self) -> None:
        """Begin the next level."""
        self.turns.reset()
        self._begin()

    def restart(self) -> None:
        """Begin this level again."""
        self.turns.set_state(self._start)
        self._begin()

    def switch_pilot(self) -> None:
        """Let the agent take over, or the person."""
        if self.agent is not None:
            self.is_piloted = not self.is_piloted
            self.message = "the agent plays" if self.is_piloted else "you play"
        else:
            self.message = "begin with --agent RUN to let a trained agent take over"
