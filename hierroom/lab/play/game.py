"""A game: one level after the other, played by a person or by a trained agent that takes over. It draws nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS, EXIT_GOAL, NO_GOAL, GoalGraph
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.constants import COL_STEP, KEY, LOCKED_DOOR, OPEN, OPEN_DOOR, PICKUP, ROW_STEP
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.level import goal_name
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.render import seen_cells
from hierroom.worlds.escape_room.replayer import ACTION_NAMES


class Game:
    """The levels of one environment, played step by step.

    A trained agent looks on while a person plays, so that it remembers what was seen when it takes over.

    Args:
        turns: one environment that does not begin its next episode by itself, and whose shortest lengths are measured.
        agent: a trained agent that can take over, None for none; the environment must be one of its `turns`.
        seed: of the agent's actions.

    Attributes:
        turns: see above.
        is_piloted: whether the agent plays.
        has_fog: whether what was not seen yet is hidden.
        has_hints: whether the oracle's next action is shown.
        message: what the last step did, or why it did nothing.
        achieved: the goal ids achieved in this level, in their order.
        seen: [size, size] bool, the cells that have been in view.
    """

    def __init__(self, turns: Turns, agent: TrainedAgent | None = None, seed: int = 0) -> None:
        self.turns = turns
        self.is_piloted = self.has_fog = self.has_hints = False
        self._agent, self._seed = agent, seed
        self._begin()

    def _begin(self) -> None:
        self._start = self.turns.get_state()
        self._pair = self._agent.pair(1, seed=self._seed) if self._agent is not None else None
        self.message, self.achieved = "", []
        self._last: Step | None = None
        self.seen: NDArray[np.bool_] = seen_cells(self.state)
        if self._pair is not None:
            self._pair.choose(self.turns, META)

    @property
    def state(self) -> State:
        """The state of the level, a copy."""
        return self.turns.world.get_state()

    @property
    def graph(self) -> GoalGraph:
        """The goal graph of the level."""
        return self.turns.world.graph_of(self.state)

    @property
    def can_be_piloted(self) -> bool:
        """Whether there is an agent that can take over."""
        return self._agent is not None

    @property
    def goal(self) -> int:
        """The goal id that the agent's meta-controller would have pursued now; -1 for none."""
        return int(self.turns.goals[0])

    @property
    def shortest(self) -> int:
        """The fewest steps in which the level can be left from its start."""
        return int(self.turns.ledger.shortest[0])

    @property
    def has_ended(self) -> bool:
        """Whether the exit or the limit of steps was reached."""
        return self._last is not None and bool(self._last.episode_ended[0])

    @property
    def has_escaped(self) -> bool:
        """Whether the exit was reached."""
        return self._last is not None and bool(self._last.terminated[0])

    @property
    def hint(self) -> str:
        """The oracle's next action and how many are left, in words."""
        if self.has_ended:
            return "none, the level has ended"
        plan = shortest_actions(self.state)
        return f"{ACTION_NAMES[int(plan[0])]} ({len(plan)} to the exit)"

    def name_of(self, goal: int) -> str:
        """A goal of the level in words, such as ``"red key 1"``."""
        return goal_name(self.state.levels[0], goal)

    def step(self, action: int | None = None) -> None:
        """Take a step, unless the level has ended.

        Args:
            action: the person's action; None: the agent's.
        """
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
        self._note(step)

    def _note(self, step: Step) -> None:
        self._last = step
        self.seen |= seen_cells(self.state)
        event = int(step.events[0])
        self.message = ""
        if event != NO_GOAL:
            self.achieved.append(event)
            self.message = f"{self.name_of(event)}!" if event != EXIT_GOAL else ""
        if self.has_ended:
            n = int(step.lengths[0])
            self.message = f"escaped in {n} steps" if self.has_escaped else f"the limit of {n} steps is reached"

    def use(self) -> None:
        """Pick up or open what is in front; where that cannot be, the message says why, and no step is taken."""
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
        """Let the agent take over, or take over from it."""
        if self.can_be_piloted:
            self.is_piloted = not self.is_piloted
            self.message = "the agent plays" if self.is_piloted else "you play"
        else:
            self.message = "begin with --agent RUN to let a trained agent take over"
