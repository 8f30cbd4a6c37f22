"""docs/environments.md is what the package has: ids, numbers, pictures, spaces and arguments."""

import importlib.util
import inspect
import io
import re
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pettingzoo
import pytest
from PIL import Image

import hierroom
from hierroom.gym_env import EscapeRoom

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "environments.md").read_text()
_spec = importlib.util.spec_from_file_location("environments", DOCS / "scripts" / "environments.py")
script = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(script)


def test_the_table_of_environments_equals_the_script_s_output():
    assert f"{script.MARKS[0]}{script.table()}{script.MARKS[1]}" in PAGE


def test_every_id_is_on_the_page():
    ids = {name for name in gymnasium.registry if re.fullmatch(r"hierroom/(EscapeRoom(-[a-g])?|Workshop)-v0", name)}
    assert len(ids) == 9
    assert set(re.findall(r"`(hierroom/\w+\S*-v0)`", PAGE)) == ids


DRAWN = {"workshop": script.workshop, **{f"level-{letter}": partial(script.level, letter) for letter in "abcdefg"}}


@pytest.mark.parametrize("name", DRAWN)
def test_pictures_equal_the_drawn_levels(name):
    kept = np.asarray(Image.open(DOCS / "pictures" / f"{name}.png").convert("RGB"))
    drawn = np.asarray(Image.open(io.BytesIO(script.as_png(DRAWN[name]()))).convert("RGB"))
    assert kept.shape == drawn.shape
    assert (abs(kept.astype(int) - drawn) > 40).mean() < 0.001  # versions of the library may pick other shades


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


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo has make from 1.27 on")
@pytest.mark.parametrize(("column", "env_id"), [(1, "hierroom/EscapeRoom-c-v0"), (2, "hierroom/Workshop-v0")])
def test_pettingzoo_facts_equal_the_environments(column, env_id):
    rows = re.findall(r"^\| (.*) \| (.*) \| (.*) \|$", PAGE.split("## Facts")[1].split("\n\n")[1], re.MULTILINE)
    facts = {row[0]: row[column].replace(" x ", ", ") for row in rows}
    assert f'`make("aec", "{env_id}")`' in facts["Creation"]
    make = pettingzoo.make
    aec, parallel = make("aec", env_id), make("parallel", env_id)
    assert aec.possible_agents == parallel.possible_agents == ["meta_0", "controller_0"]
    assert facts["Number of agents"] == str(len(aec.possible_agents))
    for env in (aec, parallel):
        for agent in env.possible_agents:
            assert f"{agent}: `{env.action_space(agent)}`" in facts["Action values"]
            seen = env.observation_space(agent)["observation"]
            assert f"`observation` is {', '.join(map(str, seen.shape))}" in facts["Observation shape"]
            assert f"whole numbers of {seen.low.min()} to {seen.high.max()}" in facts["Observation values"]
        shape, state = ", ".join(map(str, env.state_space.shape)), env.state_space
        assert re.search(rf"(^|, ){shape}\b", facts["State shape"])
        assert facts["State values"] == f"whole numbers of {state.low.min():.0f} to {state.high.max():.0f}"


def test_badge_and_listed_checkers_are_current():
    assert (DOCS / "pictures" / "pettingzoo.svg").read_bytes() == script.badge()
    checks = (DOCS.parent / "tests" / "envs" / "test_api_checkers.py").read_text()
    told = set(re.findall(r"`(\w+_test|check_env)`", PAGE.split("## Facts")[1].split("\n## ")[0]))
    assert told == set(re.findall(r"(?<= |\n)(\w+_test|check_env)\(", checks))


def test_page_lists_arguments_with_their_defaults():
    listed = dict(re.findall(r"^\| `(\w+)` \| `([^`]*)`", PAGE.split("## Arguments")[1], re.MULTILINE))
    arguments = {name: repr(value) for name, value in vars(hierroom.raw_env().single.turns.config).items()}
    for kind in (EscapeRoom, hierroom.parallel_env, hierroom.raw_env):
        parameters = inspect.signature(kind).parameters
        arguments |= {name: repr(one.default) for name, one in parameters.items() if name != "entries"}
    assert listed == arguments
    assert EscapeRoom().config.reward == "extrinsic"
