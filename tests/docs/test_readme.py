"""The examples, presets and numbers on the pages of the docs are those of the package."""

import re
from dataclasses import fields
from pathlib import Path

from escape_room import FEATURES

from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import OF_META
from hierroom.runs.config.presets import PRESETS

ROOT = Path(__file__).parents[2]
OWN, ENVIRONMENTS = ((ROOT / "docs" / f"{name}.md").read_text() for name in ("own", "environments"))
PRESETS_PAGE = (ROOT / "docs" / "presets.md").read_text()


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
    table = ENVIRONMENTS.split("| feature | numbers |")[1].split("\n\n")[0]
    listed = {name: int(numbers) for name, numbers in re.findall(r"^\| `([\w-]+)` \| (\d+) \|", table, re.MULTILINE)}
    assert listed == {name: len(feature.cardinalities) for name, feature in FEATURES.items()}
