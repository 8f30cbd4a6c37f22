"""A readable description of one level: its goals, its agent and its goal graph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, GOAL_NAMES, N_COLOURS, N_GOALS, NO_GOAL, GoalGraph
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import State

Cell = tuple[int, int]
DIRECTIONS = ("east", "south", "west", "north")


@dataclass(frozen=True)
class Goal:
    """A key, a door or the exit of a level.

    Args:
        id: 0 to 5 are the keys by colour, 6 to 11 the doors by colour, 12 is the exit.
        kind: ``"key"``, ``"door"`` or ``"exit"``.
        colour: the exit is green, like MiniGrid's goal.
        room: the branch room that the key or door opens, or that holds the exit; 0 if the goal does not exist.
        position: (row, col), counted from the grid's upper left corner; for a held key the cell where it was picked up;
            None if the goal does not exist.
        distance: Manhattan distance from the agent, ignoring walls; infinite if the goal does not exist.
        exists: whether the level has this goal.
        was_seen: whether it has been in view in this episode.
        is_reachable: whether it can be achieved now, before any other goal.
        is_legal: whether the meta-controller may choose it.
        achieved: 1 if the key is held or the door is open, else 0; for the exit 0.
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
    achieved: int

    @property
    def name(self) -> str:
        """Its colour, kind and room, such as ``"red key 1"``: see `goal_name`."""
        return _name(self.id, self.room)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class LevelAgent:
    """The agent of a level.

    Args:
        position: (row, col), counted from the grid's upper left corner.
        direction: ``"east"``, ``"south"``, ``"west"`` or ``"north"``.
        steps: primitive steps taken in this episode.
    """

    position: Cell
    direction: str
    steps: int


@dataclass(frozen=True)
class Level:
    """The level of one environment: all 13 ``goals`` by id, existing or not, its ``agent`` and its goal ``graph``."""

    goals: tuple[Goal, ...]
    agent: LevelAgent
    graph: GoalGraph

    def __str__(self) -> str:
        agent, goals = self.agent, ", ".join(map(str, self.legal_goals)) or "none"
        where = f"agent at row {agent.position[0]}, column {agent.position[1]} facing {agent.direction}"
        return f"graph {self.graph.name}, step {agent.steps}, {where}; legal goals: {goals}"

    @property
    def legal_goals(self) -> tuple[Goal, ...]:
        """The goals that the meta-controller may choose; empty if only 'no goal' is legal."""
        return tuple(goal for goal in self.goals if goal.is_legal)

    @classmethod
    def of(cls, state: State, legal: NDArray[np.bool_], reachable: NDArray[np.bool_]) -> Level:
        """Describe one environment, given the goals [13] that may be chosen and those that can be achieved now."""
        record = state.levels[0]
        here = int(record.row) - MARGIN, int(record.col) - MARGIN
        n_branches, branches, seen = int(record.n_rooms) - 1, record.branches.tolist(), int(record.seen)
        cells = {"key": record.keys_at.tolist(), "door": record.doors_at.tolist()}
        done = {"key": int(record.keys), "door": int(record.doors)}
        is_legal, is_reachable = legal.tolist(), reachable.tolist()
        goals = []
        for goal in range(N_GOALS):
            if goal == EXIT_GOAL:
                kind, colour, room, exists, achieved = "exit", "green", int(record.exit_room), True, 0
                row, col = record.exit_at.tolist()
            else:
                kind, branch = "key" if goal < FIRST_DOOR_GOAL else "door", branches[goal % N_COLOURS]
                colour, exists = COLOURS[goal % N_COLOURS], branch < n_branches
                room, achieved = branch + 1 if exists else 0, done[kind] >> branch & 1
                row, col = cells[kind][branch]
            position = (row - MARGIN, col - MARGIN) if exists else None
            distance = math.inf if position is None else abs(position[0] - here[0]) + abs(position[1] - here[1])
            flags = (exists, bool(seen >> goal & 1), is_reachable[goal], is_legal[goal], achieved)
            goals.append(Goal(goal, kind, colour, room, position, distance, *flags))
        agent = LevelAgent(here, DIRECTIONS[record.direction], int(record.steps))
        return cls(tuple(goals), agent, graph_of(record))


def graph_of(level: np.record) -> GoalGraph:
    """Return the goal graph of a level."""
    return GoalGraph(tuple(level.key_rooms[: level.n_rooms - 1].tolist()), int(level.exit_room))


def goal_name(level: np.record, goal: int) -> str:
    """Return the name of a goal or -1: ``"red key 1"`` with its branch room if any, ``"exit"`` or ``"no goal"``."""
    branch = N_COLOURS if goal in (EXIT_GOAL, NO_GOAL) else int(level.branches[goal % N_COLOURS])
    return _name(goal, branch + 1 if branch < level.n_rooms - 1 else 0)


def _name(goal: int, room: int) -> str:
    if goal == NO_GOAL:
        return "no goal"
    return f"{GOAL_NAMES[goal]} {room}" if room and goal != EXIT_GOAL else GOAL_NAMES[goal]
