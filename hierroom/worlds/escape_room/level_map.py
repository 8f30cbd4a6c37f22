"""Text maps of levels, drawn in an editor: walls, doors, keys, the exit and the start."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

from hierroom.goals import COLOURS, GoalGraph, is_graph_name
from hierroom.support.errors import InputError, shown
from hierroom.support.files import as_utf8, read_text
from hierroom.worlds.escape_room.constants import MAX_SIZE, MIN_SIZE
from hierroom.worlds.escape_room.map_rooms import Cell, Drawn, MapRooms, read_rooms

WALL_CHARACTER, EXIT_CHARACTER, KEY_CHARACTERS, DOOR_CHARACTERS = "#", "E", "rgbpyw", "RGBPYW"
START_CHARACTERS = ">v<^@"
"""Start by direction, in the order of `constants`; with the last one each episode draws a direction."""
LEGEND = (
    f"{WALL_CHARACTER} wall; space or . floor; @ start (or > v < ^ with its direction); {EXIT_CHARACTER} exit; doors "
    f"{' '.join(DOOR_CHARACTERS)} ({', '.join(COLOURS)}) and their keys {' '.join(KEY_CHARACTERS)}"
)
MIN_ROWS = 3
_MOST_BYTES = 2**20
_ALLOWED = frozenset(f"{WALL_CHARACTER} {EXIT_CHARACTER}{KEY_CHARACTERS}{DOOR_CHARACTERS}{START_CHARACTERS}")

MapSpec = str | Path | Mapping[str, Any]
"""The text of a map, the path of its file, or a dict from `LevelMap.to_dict`."""


@dataclass(frozen=True)
class LevelMap:
    """A fixed level, drawn as text: see `LEGEND`.

    Args:
        name: the name in titles and tables.
        rows: the rows of the map, one character per cell.
        offset: (row, col) of the first cell in the original text, for messages.
    """

    name: str
    rows: tuple[str, ...] = field(repr=False)
    offset: Cell = field(default=(0, 0), repr=False, compare=False)

    def __post_init__(self) -> None:
        if is_graph_name(self.name):
            raise InputError(f"{self.name} is the name of a goal graph; give the layout another name")
        _ = self.graph  # refuses a map that cannot be played

    def __str__(self) -> str:
        return self.name

    @cached_property
    def drawn(self) -> Drawn:
        """The cells of everything in the map."""
        self._check_form()
        places: dict[str, Cell] = {}
        for row, line in enumerate(self.rows):
            for col, character in enumerate(line):
                if character not in _ALLOWED:
                    self._refuse((row, col), f"{character!r} means nothing; a map has {LEGEND}")
                if character in "# ":
                    continue
                kind = "@" if character in START_CHARACTERS else character
                if (first := places.setdefault(kind, (row, col))) != (row, col):
                    self._refuse((row, col), f"a second {_name(kind)}; the first is at {self._where(first)}")
        last_row, last_col = len(self.rows) - 1, len(self.rows[0]) - 1
        for row, col in product(range(last_row + 1), range(last_col + 1)):
            if (row in (0, last_row) or col in (0, last_col)) and self.rows[row][col] != WALL_CHARACTER:
                self._refuse((row, col), f"the border must be wall, {WALL_CHARACTER}, all around")
        for character, what in (("@", "start (@, or > v < ^ with its direction)"), (EXIT_CHARACTER, "exit (E)")):
            if character not in places:
                raise InputError(f"{self._says} there is no {what}; a map has {LEGEND}")
        keys, doors = (
            {colour: places[one] for colour, one in enumerate(characters) if one in places}
            for characters in (KEY_CHARACTERS, DOOR_CHARACTERS)
        )
        for have, lack, kind, other in ((keys, doors, "key", "door"), (doors, keys, "door", "key")):
            for colour in have.keys() - lack.keys():
                character = (DOOR_CHARACTERS if other == "door" else KEY_CHARACTERS)[colour]
                self._refuse(have[colour], f"the {COLOURS[colour]} {kind} has no {other}: there is no {character}")
        floor = frozenset(
            (row, col)
            for row, line in enumerate(self.rows)
            for col, character in enumerate(line)
            if character not in (WALL_CHARACTER, EXIT_CHARACTER, *DOOR_CHARACTERS)
        )
        return Drawn(floor, places["@"], places[EXIT_CHARACTER], keys, doors)

    @cached_property
    def rooms(self) -> MapRooms:
        """The rooms and their dependencies."""
        return read_rooms(self.drawn, self._refuse, self._where)

    @cached_property
    def graph(self) -> GoalGraph:
        """The goal graph, with the map's name."""
        return GoalGraph(self.rooms.key_rooms, self.rooms.exit_room, self.name)

    @property
    def direction(self) -> int:
        """The direction at the start, or -1 if each episode draws one."""
        row, col = self.drawn.start
        found = START_CHARACTERS.index(self.rows[row][col])
        return -1 if START_CHARACTERS[found] == "@" else found

    @property
    def size(self) -> int:
        """Cells along a side of the square grid that holds the map, walls around it included."""
        return max(MIN_SIZE, len(self.rows), len(self.rows[0]))

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain types: ``name`` and ``map``, its rows."""
        return {"name": self.name, "map": list(self.rows)}

    @classmethod
    def of(cls, spec: MapSpec | LevelMap) -> LevelMap:
        """Return the map in a text, a file or a dict from `to_dict`."""
        if isinstance(spec, LevelMap):
            return spec
        if isinstance(spec, Mapping):
            return cls._from_dict(spec)
        if isinstance(spec, str) and "\n" in spec:
            rows, offset = _rows_of(spec)
            return cls(f"map-{hashlib.sha256(repr(rows).encode()).hexdigest()[:6]}", rows, offset)
        if isinstance(spec, (str, Path)) and str(spec):
            rows, offset = _rows_of(read_text(Path(spec), _MOST_BYTES, "the layout "))
            named = as_utf8(Path(spec))
            try:
                return cls(named.stem, rows, offset)
            except InputError:  # the map cannot be played, or a goal graph has its name, such as a
                return cls(named.name, rows, offset)
        raise InputError(f"a layout is a text map of several lines, or the path of its file, not {shown(spec)}")

    @classmethod
    def _from_dict(cls, table: Mapping[str, Any]) -> LevelMap:
        rows: Any = table.get("map")
        lines = rows.split("\n") if isinstance(rows, str) else rows
        is_right = {*table} == {"name", "map"} and isinstance(table["name"], str) and isinstance(lines, (list, tuple))
        if not is_right or not all(isinstance(line, str) for line in lines):
            raise InputError(
                f"a layout in a table holds name, a text, and map, its rows, and nothing else, not {shown(table)}"
            )
        return cls(table["name"], *_rows_of("\n".join(lines)))

    def _check_form(self) -> None:
        rows, name = self.rows, self._says
        if not rows:
            raise InputError(f"{name} it is empty; a map has {LEGEND}")
        if not MIN_ROWS <= len(rows) <= MAX_SIZE or not MIN_ROWS <= len(rows[0]) <= MAX_SIZE:
            raise InputError(
                f"{name} a map has {MIN_ROWS} to {MAX_SIZE} rows and columns, not {len(rows)} rows and "
                f"{len(rows[0])} columns"
            )
        for row, line in enumerate(rows):
            if len(line) != len(rows[0]):
                self._refuse(
                    (row, min(len(line), len(rows[0]))),
                    f"the row has {len(line)} cells, but the first has {len(rows[0])}; all rows must be as long",
                )

    @property
    def _says(self) -> str:
        return f"layout {self.name}:"

    def _where(self, cell: Cell) -> str:
        return f"row {cell[0] + self.offset[0] + 1}, column {cell[1] + self.offset[1] + 1}"

    def _refuse(self, cell: Cell, why: str) -> NoReturn:
        raise InputError(f"{self._says} {self._where(cell)}: {why}")


def as_maps(specs: Any) -> tuple[LevelMap, ...]:
    """Return the maps of one or several specs, with distinct names."""
    several = specs if isinstance(specs, Sequence) and not isinstance(specs, str) else (specs,)
    maps = tuple(map(LevelMap.of, several))
    for number, one in enumerate(maps):
        if one.name in (other.name for other in maps[:number]):
            raise InputError(f"two layouts are named {one.name}; give one of the files another name")
    return maps


def _rows_of(text: str) -> tuple[tuple[str, ...], Cell]:
    """Return the rows of a map, and the place of the first cell in the text.

    Common indentation, empty lines before and after, and spaces at the ends of lines are not part of a map.
    """
    lines = [line.rstrip() for line in text.splitlines()]
    filled = [number for number, line in enumerate(lines) if line]
    if not filled:
        return (), (0, 0)
    rows = lines[filled[0] : filled[-1] + 1]
    indent = min(len(row) - len(row.lstrip(" ")) for row in rows if row)
    return tuple(row[indent:].replace(".", " ") for row in rows), (filled[0], indent)


def _name(character: str) -> str:
    if character in KEY_CHARACTERS:
        return f"{COLOURS[KEY_CHARACTERS.index(character)]} key"
    if character in DOOR_CHARACTERS:
        return f"{COLOURS[DOOR_CHARACTERS.index(character)]} door"
    return "exit" if character == EXIT_CHARACTER else "start"
