"""docs/own.md and docs/tasks.md list everything that user code is given, and nothing else."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from hierroom.turns.records import STEP
from hierroom.turns.situation import Situation
from hierroom.worlds.base_view import BaseView
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import LEVEL, MEMORIES
from hierroom.worlds.escape_room.level_view import LevelView

DOCS = Path(__file__).parents[2] / "docs"
PAGE, TASKS = (DOCS / "own.md").read_text(), (DOCS / "tasks.md").read_text()


def listed(heading: str, page: str = PAGE) -> set[str]:
    table = page.split(f"| {heading} |")[1].split("\n\n")[0]
    rows = [line.split(" | ")[0] for line in table.splitlines()[2:]]
    return {name.split("(")[0] for row in rows for name in re.findall(r"`([^`]+)`", row)}


def public(kind: type) -> set[str]:
    return {name for name in vars(kind) if not name.startswith("_")}


def test_page_lists_the_fields_of_a_step():
    assert listed("`step.`") == {*(STEP.names or ()), "achieved", "is_first", "before", "after", "outcomes"}


def test_page_lists_the_fields_of_a_level():
    assert listed("`state.levels[...]`") == set(LEVEL.names or ())
    assert set(MEMORIES) <= set(LEVEL.names or ())
    assert f"[N, size + {2 * MARGIN}, size + {2 * MARGIN}]" in PAGE
    assert f"a margin of {MARGIN} cells" in PAGE


@pytest.mark.parametrize(
    ("view", "heading", "page"), [(LevelView, "`situation.`", PAGE), (BaseView, "`situation.` in a task", TASKS)]
)
def test_page_lists_the_fields_of_a_situation(view, heading, page):
    known = {field.name for kind in (Situation, view) for field in fields(kind)}
    known |= public(Situation) | public(view)
    assert listed(heading, page) == known - {"as_dict", "validate_goals", "merged"}
