"""The tables of the docs are what the package has: ids, spaces, arguments, presets, features and what user code has."""

import importlib.util
import inspect
import re
from dataclasses import fields
from pathlib import Path

import pytest
from escape_room import FEATURES

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import OF_META
from hierroom.runs.config.presets import PRESETS
from hierroom.turns.records import STEP
from hierroom.turns.situation import Situation
from hierroom.worlds.base_view import BaseView
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import LEVEL, MEMORIES
from hierroom.worlds.escape_room.level_view import LevelView

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "environments.md").read_text()
_spec = importlib.util.spec_from_file_location("environments", DOCS / "scripts" / "environments.py")
script = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(script)


def test_the_table_of_environments_equals_the_script_s_output():
    assert f"{script.MARKS[0]}{script.table()}{script.MARKS[1]}" in PAGE


def test_spaces_equal_the_page_s_table():
    env, dropping = hierroom.env(graph="c"), hierroom.env(graph="c", drop_key=True)
    for agent in env.possible_agents:
        assert f"{agent}: `{env.action_space(agent)}`" in PAGE
    assert f"with `drop_key=True` `{dropping.action_space('controller_0')}`" in PAGE
    section = PAGE.split("## Observations")[1].split("\n## ")[0]
    listed = {}
    for names, whose, shape in re.findall(r"^\| (`[^|]*`) \| ([^|]*) \| ([^|]*) \|", section, re.MULTILINE):
        for name in re.findall(r"`(\w+)`", names):
            listed[name] = whose, re.sub(r",? u?int8|,? float32", "", shape)
    meta, controller = (env.observation_space(agent) for agent in ("meta_0", "controller_0"))
    assert set(listed) == set(meta)
    assert set(meta) - set(controller) == {name for name, (whose, _) in listed.items() if whose == "`meta_0`"}
    for name in set(meta) - {"action_mask"}:
        shape = meta[name].shape
        assert listed[name][1] == (" x ".join(map(str, shape)) if shape else "a number")


def test_page_lists_arguments_with_their_defaults():
    listed = dict(re.findall(r"^\| `(\w+)` \| `([^`]*)`", PAGE.split("## Arguments")[1], re.MULTILINE))
    arguments = {name: repr(value) for name, value in vars(hierroom.raw_env().single.turns.config).items()}
    for kind in (EscapeRoom, hierroom.parallel_env, hierroom.raw_env):
        parameters = inspect.signature(kind).parameters
        arguments |= {name: repr(one.default) for name, one in parameters.items() if name != "entries"}
    assert listed == arguments
    assert EscapeRoom().config.reward == "extrinsic"


OWN, TASKS = (DOCS / "own.md").read_text(), (DOCS / "tasks.md").read_text()


def listed(heading: str, page: str = OWN) -> set[str]:
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
    assert f"[N, size + {2 * MARGIN}, size + {2 * MARGIN}]" in OWN
    assert f"a margin of {MARGIN} cells" in OWN


@pytest.mark.parametrize(
    ("view", "heading", "page"), [(LevelView, "`situation.`", OWN), (BaseView, "`situation.` in a task", TASKS)]
)
def test_page_lists_the_fields_of_a_situation(view, heading, page):
    known = {field.name for kind in (Situation, view) for field in fields(kind)}
    known |= public(Situation) | public(view)
    assert listed(heading, page) == known - {"as_dict", "validate_goals", "merged"}


PRESETS_PAGE = (DOCS / "presets.md").read_text()


def test_the_presets_are_documented_value_by_value():
    table = PRESETS_PAGE.split("\n## ")[0]
    rows = re.findall(r"^\| (`.*?) \| (.*?) \| (.*?) \|", table, re.MULTILINE)
    shown = {}
    for entries, *values in rows:
        names = re.findall(r"`(\w+)`", entries)
        for preset, value in zip(("default", "paper"), values, strict=True):
            for name, one in zip(names, value.split(", "), strict=False):
                shown[preset, name] = one.strip("`")
    entries = {field.name for field in fields(PPOConfig)} - {"sequences_per_update"}
    for preset in ("default", "paper"):
        flat = PRESETS[preset].entries
        for name in entries | {"steps", "num_envs", "size", "max_steps", "subgoal_horizon", "goal_mask"}:
            assert shown[preset, name] == str(flat[name]), (preset, name)
    for name in PRESETS["default"].agents.features:
        assert f"`{name}`" in PRESETS_PAGE


def test_entries_of_only_some_methods_are_documented_value_by_value():
    section = PRESETS_PAGE.split("## What only some methods use")[1].split("\n## ")[0]
    shown = {entry: value.strip(" `") for entry, value in re.findall(r"^\| `(.*?)` \|(.*?)\|", section, re.MULTILINE)}
    usual = {f"{OF_META}{name}": value for name, value in vars(PRESETS["default"].ppo).items()}
    for config in (preset for name, preset in PRESETS.items() if name != "algorithm1"):
        of_meta = {n: str(v) for n, v in config.entries.items() if n.startswith(OF_META) and v != usual[n]}
        alone = {n: str(config.entries[n]) for n in ("meta_start_success", "novelty_bonus", "curiosity_weight")}
        assert shown == {**of_meta, **alone, "meta_features": ", ".join(config.agents.meta_features)}


def test_algorithm_1_differs_from_the_paper_s_preset_as_documented():
    section = PRESETS_PAGE.split("## Algorithm 1 to the letter")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \|(.*?)\|", section, re.MULTILINE)
    paper, ours = PRESETS["paper"].entries, PRESETS["algorithm1"].entries
    changed = {n for n in ours if ours[n] != paper[n]} - {"preset"}
    assert {entry: value.strip(" `") for entry, value in rows} == {
        name: ", ".join(ours[name]) if isinstance(ours[name], tuple) else str(ours[name]) for name in changed
    }


def test_entries_that_other_presets_change_are_documented_value_by_value():
    section = PRESETS_PAGE.split("## What the other presets change")[1].split("\n## ")[0]
    shown = {}
    for entry, *values in re.findall(r"^\| `(\w+)` \|(.*?)\|(.*?)\|(.*?)\|", section, re.MULTILINE):
        for preset, value in zip(("long", "large", "learned"), values, strict=True):
            if value.strip():
                shown[preset, entry] = value.strip(" `")
    default, changed = PRESETS["default"].entries, {}
    for preset in ("long", "large", "learned"):
        entries = PRESETS[preset].entries
        for name, usual in default.items():
            if name != "preset" and entries[name] != usual:
                changed[preset, name] = ", ".join(entries[name]) if name == "features" else str(entries[name])
    assert shown == changed


def test_every_feature_is_documented_with_its_count():
    table = PAGE.split("| feature | numbers |")[1].split("\n\n")[0]
    listed = {name: int(numbers) for name, numbers in re.findall(r"^\| `([\w-]+)` \| (\d+) \|", table, re.MULTILINE)}
    assert listed == {name: len(feature.cardinalities) for name, feature in FEATURES.items()}
