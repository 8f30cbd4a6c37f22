"""Find the rooms of a map and its goal graph by flooding the floor, door by door."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NoReturn

from hierroom.goals import COLOURS
from hierroom.goals.tree import canonical_order

Cell = tuple[int, int]
"""(row, col), counted from 0."""


@dataclass(frozen=True)
class Drawn:
    """Cells of everything in a map, keys and doors by colour. Keys are on ``floor``; doors and the exit are not."""

    floor: frozenset[Cell]
    start: Cell
    exit: Cell
    keys: Mapping[int, Cell]
    doors: Mapping[int, Cell]


@dataclass(frozen=True)
class MapRooms:
    """The rooms of a map; room 0 is where the agent starts, and rooms are numbered as in `GoalGraph.canonical`.

    Args:
        key_rooms: the rooms [rooms - 1] with the key of room 1, 2, ...
        exit_room: the room of the exit.
        door_rooms: [rooms - 1] the room from which the door of room 1, 2, ... is opened.
        colours: [rooms - 1] the colour of that door and key.
        room_of: the room of each cell that can be entered, except doors.
    """

    key_rooms: tuple[int, ...]
    exit_room: int
    door_rooms: tuple[int, ...]
    colours: tuple[int, ...]
    room_of: Mapping[Cell, int]


def read_rooms(drawn: Drawn, refuse: Callable[[Cell, str], NoReturn], where: Callable[[Cell], str]) -> MapRooms:
    """Return the rooms of a map, or ``refuse`` it, with a cell, if it cannot be solved or is no tree of keys and doors.

    A room is the floor that a door makes reachable. A door may be opened from any room. A goal graph orders goals by
    keys alone. So an agent with the key of a door must have passed through every door on the way to that door.
    """
    doors, name = drawn.doors, {colour: f"the {COLOURS[colour]} door" for colour in drawn.doors}
    at_door = {cell: colour for colour, cell in doors.items()}
    for colour, cell in sorted(doors.items(), key=lambda item: item[1]):
        if touching := [at_door[one] for one in _beside(cell) if one in at_door]:
            refuse(cell, f"{name[colour]} touches {name[touching[0]]}; put floor or wall between two doors")

    # The room of each cell, and the room from which each door is opened. A room is its door's colour; -1 is the start.
    room_of = dict.fromkeys(_flood([drawn.start], drawn.floor), -1)
    door_rooms: dict[int, int] = {}
    order = [-1]
    for room in order:
        for colour, cell in sorted(doors.items(), key=lambda item: item[1]):
            if colour in door_rooms or all(room_of.get(one) != room for one in _beside(cell)):
                continue
            door_rooms[colour] = room
            behind = [one for one in _beside(cell) if one in drawn.floor and room_of.get(one) != room]
            if other := [room_of[one] for one in behind if one in room_of]:
                way = "the start" if other[0] < 0 else name[other[0]]
                refuse(cell, f"{name[colour]} is in a loop: the room behind it can be entered from {way} as well")
            if not behind and drawn.exit not in _beside(cell):
                refuse(cell, f"{name[colour]} opens nothing: the same room, or wall, is on all its sides")
            room_of |= dict.fromkeys(_flood(behind, drawn.floor), colour)
            order.append(colour)
    for kind, cells in (("door", doors), ("key", drawn.keys)):
        for colour, cell in cells.items():
            if (colour not in door_rooms) if kind == "door" else (cell not in room_of):
                refuse(cell, f"the {COLOURS[colour]} {kind} cannot be reached: no way leads to it, even by other doors")

    exit_rooms = {room_of.get(one, at_door.get(one)) for one in _beside(drawn.exit)} - {None}
    if not exit_rooms:
        refuse(drawn.exit, "the exit cannot be reached: no way leads to it, even through the doors")
    if -1 in exit_rooms:
        refuse(drawn.exit, "the exit can be reached before any door is open; it must be behind a door")
    if len(exit_rooms) > 1:
        ways = " and from behind ".join(sorted(name[one] for one in exit_rooms if one is not None))
        refuse(drawn.exit, f"the exit is entered from behind {ways}; a tree of keys and doors has one way to it")
    exit_room = next(iter(exit_rooms))
    assert exit_room is not None
    key_rooms = {colour: room_of[cell] for colour, cell in drawn.keys.items()}

    entered, n_before = {-1}, 0  # the rooms that can be entered in some order, by the colours of their doors
    while len(entered) > n_before:
        n_before = len(entered)
        entered |= {one for one, room in door_rooms.items() if room in entered and key_rooms[one] in entered}
    for what, cell, room in (
        ("exit", drawn.exit, exit_room),
        *((f"{COLOURS[colour]} key", drawn.keys[colour], room) for colour, room in key_rooms.items()),
    ):
        if room not in entered:
            locked = next(one for one in _ways(room, door_rooms) if door_rooms[one] in entered)
            key = f"the key of that door, at {where(drawn.keys[locked])}, is out of reach before that door opens"
            refuse(cell, f"the {what} cannot be reached in any order: it is behind {name[locked]}, and {key}")
    for colour, room in door_rooms.items():
        if room not in (passed := _ways(key_rooms[colour], key_rooms)):
            least = "the start" if passed == [-1] else name[passed[0]]
            refuse(
                doors[colour],
                f"{name[colour]} stands behind {name[room]}, but its key, at {where(drawn.keys[colour])}, does not: "
                f"the door needs both, and in a tree of keys and doors each needs one thing (put the key behind "
                f"{name[room]}, or the door where {least} leads)",
            )

    colours = [colour for colour in order if colour >= 0]
    number = {-1: 0} | {colour: n for n, colour in enumerate(colours, start=1)}
    numbers = canonical_order([number[key_rooms[colour]] for colour in colours], number[exit_room])
    colours = [colours[old - 1] for old in numbers[1:]]
    number = {-1: 0} | {colour: n for n, colour in enumerate(colours, start=1)}
    return MapRooms(
        tuple(number[key_rooms[colour]] for colour in colours),
        number[exit_room],
        tuple(number[door_rooms[colour]] for colour in colours),
        tuple(colours),
        {cell: number[room] for cell, room in room_of.items()} | {drawn.exit: number[exit_room]},
    )


def _beside(cell: Cell) -> list[Cell]:
    row, col = cell
    return [(row - 1, col), (row, col - 1), (row, col + 1), (row + 1, col)]


def _flood(start: Iterable[Cell], floor: frozenset[Cell]) -> set[Cell]:
    found = {*start}
    frontier = [*found]
    while frontier:
        new = {one for one in _beside(frontier.pop()) if one in floor} - found
        found |= new
        frontier += new
    return found


def _ways(room: int, parents: Mapping[int, int]) -> list[int]:
    """Return a room, the room on the way to it, and so on to the first one, -1."""
    passed = [room]
    while passed[-1] >= 0:
        passed.append(parents[passed[-1]])
    return passed
