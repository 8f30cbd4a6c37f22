"""A config that is written and read back is equal, in each form and each world: no entry is lost as a default."""

import json
from dataclasses import replace

import gymnasium
import pytest
from gymnasium.envs.registration import EnvSpec

from hierroom.agents.config import USUAL_FEATURES
from hierroom.goals import GoalGraph
from hierroom.runs.config.config import PARTS, TrainConfig
from hierroom.runs.config.presets import PRESETS, find_preset
from hierroom.runs.config.run_name import run_name
from hierroom.runs.folder.config_file import OF_ENVIRONMENTS, read_config
from hierroom.runs.minari import env_spec
from hierroom.support.errors import InputError
from hierroom.support.files import to_json
from hierroom.train import parse
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, OF_DRAWN, OF_ESCAPE_ROOMS, EnvConfig

MAZE = "###########\n#@r  R   E#\n###########"
USUAL = TrainConfig()
SHOP = USUAL.changed(task="workshop:4")
CONFIGS = [
    *PRESETS.values(),
    *(preset.changed(task="workshop:4", meta="random") for preset in PRESETS.values()),
    SHOP.changed(max_steps=DEFAULT_MAX_STEPS, meta="learned", **USUAL_FEATURES),  # defaults of EscapeRooms
    SHOP.changed(goal_mask="existing", subgoal_horizon=50, meta_features=("goal-status",)),
    USUAL.changed(max_steps=50).changed(task="workshop:4"),
    USUAL.changed(graph=["a", GoalGraph((0, 0), 1, label='"a > b", ü')], exclude="a", drop_key=True, reward="bonus"),
    USUAL.changed(graph=["rooms:3", "rooms:4"], exclude=["c", "d"], curriculum_stages=3),
    find_preset("large").changed(layout=MAZE, max_steps=9),
]


@pytest.mark.parametrize("config", CONFIGS, ids=run_name)
def test_config_written_and_read_back_is_equal(config, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = json.loads(to_json(config.to_dict()))
    assert TrainConfig.from_dict(table).to_dict() == config.to_dict()
    assert find_preset(config.preset).changed(**config.entries) == config
    assert find_preset(config.preset).changed(**{part: getattr(config, part) for part in PARTS}).env == config.env
    assert gymnasium.make("hierroom/EscapeRoom-v0", **vars(config.env)).unwrapped.config == config.env
    filled = replace(config.env, reward=config.env.reward or "intrinsic")  # as `Turns` does
    spec, _ = env_spec(filled, "none")
    recovered = gymnasium.make(EnvSpec.from_json(spec.to_json())).unwrapped.config
    assert recovered == filled
    assert EnvConfig(**table["env"]) == config.env
    unused = OF_ESCAPE_ROOMS if config.env.task else OF_DRAWN if config.env.layout else ()
    typed = {name: one for name, one in _flat(table).items() if name not in (*OF_ENVIRONMENTS, *unused)}
    (tmp_path / "own.toml").write_text("".join(f"{name} = {_toml(one)}\n" for name, one in typed.items()), "utf-8")
    assert read_config("own.toml") == config
    if not any(isinstance(one, dict) for name in ("graph", "exclude", "layout") for one in typed.get(name, ())):
        assert parse([word for name, one in typed.items() for word in _words(name, one)]).config == config


def test_run_names_of_different_configs_differ():
    names = {run_name(config): config for config in CONFIGS}
    assert len(names) == len(CONFIGS)


def _flat(table):
    own = {name: one for part in PARTS if part != "meta_ppo" for name, one in table[part].items()}
    learner = {f"meta_ppo.{name}": one for name, one in table["meta_ppo"].items()}
    return own | learner | {name: one for name, one in table.items() if name not in PARTS}


def _toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {_toml(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps("None" if value is None else value)


def _words(name, value):
    option = name.replace("_", "-")
    if isinstance(value, bool):
        part, dot, entry = option.rpartition(".")
        return [f"--{option}" if value else f"--{part}{dot}no-{entry}"]
    return [f"--{option}", *map(str, value if isinstance(value, list) else [value])] if value != [] else []


def test_task_instead_of_escape_rooms_gets_its_own_defaults_and_keeps_what_was_given(tmp_path):
    shop = EnvConfig(task="workshop:4")
    for preset in PRESETS.values():
        env = preset.env.changed(task="workshop:4")
        assert env == replace(shop, goal_mask=preset.env.goal_mask, subgoal_horizon=preset.env.subgoal_horizon)
    assert USUAL.changed(env=shop) == USUAL.changed(task="workshop:4") == TrainConfig(shop)
    agents = replace(USUAL.agents, meta_features=("goal-status",))
    assert USUAL.changed(task="workshop:4", agents=agents).agents == agents
    (tmp_path / "own.toml").write_text(f"max_steps = {DEFAULT_MAX_STEPS}", "utf-8")
    assert read_config(tmp_path / "own.toml", task="workshop:4").env.max_steps == DEFAULT_MAX_STEPS
    with pytest.raises(InputError, match=r"^hierroom/EscapeRoom-c-v0 has its own graphs: give a task to "):
        gymnasium.make("hierroom/EscapeRoom-c-v0", task="workshop:4")
