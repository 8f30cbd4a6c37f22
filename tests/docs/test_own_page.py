"""docs/own.md lists everything that user code is given, and nothing else."""

import re
from dataclasses import fields
from pathlib import Path

from hierroom.turns.records import STEP
from hierroom.turns.situation import Situation
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import LEVEL, MEMORIES
from hierroom.worlds.escape_room.level_view import LevelView

PAGE = (Path(__file__).parents[2] / "docs" / "own.md").read_text()


def listed(heading: str) -> set[str]:
    table = PAGE.split(f"| `{heading}` |")[1].split("\n\n")[0]
    rows = [line.split(" | ")[0] for line in table.splitlines()[2:]]
    return {name.split("(")[0] for row in rows for name in re.findall(r"`([^`]+)`", row)}


def public(kind: type) -> set[str]:
    return {name for name in vars(kind) if not name.startswith("_")}


def test_page_lists_the_fields_of_a_step():
    assert listed("step.") == {*(STEP.names or ()), "achieved", "is_first", "before", "after", "outcomes"}


def test_page_lists_the_fields_of_a_level():
    assert listed("state.levels[...]") == set(LEVEL.names or ())
    assert set(MEMORIES) <= set(LEVEL.names or ())
    assert f"[N, size + {2 * MARGIN}, size + {2 * MARGIN}]" in PAGE
    assert f"a margin of {MARGIN} cells" in PAGE


def test_page_lists_the_fields_of_a_situation():
    known = {field.name for kind in (Situation, LevelView) for field in fields(kind)}
    known |= public(Situation) | public(LevelView)
    assert listed("situation.") == known - {"as_dict", "validate_goals"}
