"""One level in words: its goals, its agent and its goal graph, for those who would rather not read arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, GoalGraph
from hierroom.world.kernels import MARGIN
from hierroom.world.layout import State

Cell = tuple[int, int]
DIRECTIONS = ("east", "south", "west", "north")


@dataclass(frozen=True)
class Goal:
    """A key, a door or the exit of a level.

    Args:
        id: 0 to 5 the keys by colour, 6 to 11 the doors by colour, 12 the exit.
        kind: ``"key"``, ``"door"`` or ``"exit"``.
        colour: its name; the exit is green, as MiniGrid's goal is.
        room: the branch room that the key or door opens, or in which the exit lies; 0 where there is no such goal.
        position: (row, col) of its cell, from the grid's upper left corner; a key in hand has that where it lay, a goal
            that does not exist has None.
        distance: rows plus columns from the agent to it, as the crow flies; infinite where it does not exist.
        exists: whether the level has it.
        was_seen: whether it came into view this episode.
        is_reachable: whether it can be achieved now, before anything else is.
        is_legal: whether the meta-controller may choose it.
        was_achieved: whether the key is held, the door open.
    """

    id: int
    kind: Literal["key", "door", "exit"]
    colour: str
    room: int
    position: Cell | None
    distance: float
    exists: bool
    was_seen: bool
    is_reachable: bool
    is_legal: bool
    was_achieved: bool


@dataclass(frozen=True)
class LevelAgent:
    """The agent of a level.

    Args:
        position: (row, col) of its cell, from the grid's upper left corner.
        direction: where it faces: ``"east"``, ``"south"``, ``"west"`` or ``"north"``.
        steps: primitive steps taken this episode.
    """

    position: Cell
    direction: str
    steps: int


@dataclass(frozen=True)
class Level:
    """One environment in words.

    Args:
        goals: all 13, by id; those that the level does not have are there too, see `Goal.exists`.
        agent: where the agent stands.
        graph: the goal graph.
    """

    goals: tuple[Goal, ...]
    agent: LevelAgent
    graph: GoalGraph

    @property
    def legal_goals(self) -> tuple[Goal, ...]:
        """The goals that the meta-controller may choose; none, where only 'no goal' is legal."""
        return tuple(goal for goal in self.goals if goal.is_legal)

    @classmethod
    def of(cls, state: State, legal: NDArray[np.bool_], reachable: NDArray[np.bool_]) -> Level:
        """The level of an environment.

        Args:
            state: one environment.
            legal: [13] bool, the goals that may be chosen.
            reachable: [13] bool, the goals that can be achieved now.
        """
        record = state.levels[0]
        here = int(record.row) - MARGIN, int(record.col) - MARGIN
        n_branches, branches = int(record.n_rooms) - 1, record.branches.tolist()
        cells = {"key": record.keys_at.tolist(), "door": record.doors_at.tolist()}
        achieved = {"key": int(record.keys), "door": int(record.doors)}
        goals = []
        for goal in range(N_GOALS):
            if goal == EXIT_GOAL:
                kind, colour, room, exists, was_achieved = "exit", "green", int(record.exit_room), True, False
                row, col = record.exit_at.tolist()
            else:
                kind, branch = "key" if goal < FIRST_DOOR_GOAL else "door", branches[goal % N_COLOURS]
                colour, exists = COLOURS[goal % N_COLOURS], branch < n_branches
                room, was_achieved = branch + 1 if exists else 0, bool(achieved[kind] >> branch & 1)
                row, col = cells[kind][branch]
            position = (row - MARGIN, col - MARGIN) if exists else None
            distance = math.inf if position is None else abs(position[0] - here[0]) + abs(position[1] - here[1])
            was_seen = bool(int(record.seen) >> goal & 1)
            flags = (exists, was_seen, bool(reachable[goal]), bool(legal[goal]), was_achieved)
            goals.append(Goal(goal, kind, colour, room, position, distance, *flags))
        agent = LevelAgent(here, DIRECTIONS[record.direction], int(record.steps))
        graph = GoalGraph(tuple(record.key_rooms[:n_branches].tolist()), int(record.exit_room))
        return cls(tuple(goals), agent, graph)
