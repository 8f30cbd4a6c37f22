"""docs/environments.md is what the package has: ids, numbers, pictures, spaces and arguments."""

import importlib.util
import inspect
import re
from pathlib import Path

import hierroom
from hierroom.gym_env import EscapeRoom

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
