"""Config files: the entries of the command line, and one-line errors."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from hierroom.goals import GoalGraph
from hierroom.lab.sweep.plan import read_plan
from hierroom.runs import session
from hierroom.runs.config.config import META_PPO, TrainConfig
from hierroom.runs.config.presets import find_preset
from hierroom.runs.folder.config_file import read_config
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError, warn_once
from hierroom.train import main as train
from hierroom.train import parse

OWN = """
preset = "long"
graph = "f"
num_envs = 32
gamma = 1
features = ["view", "goal"]
drop_key = true
subgoal_horizon = "None"

[meta_ppo]
gamma = 0.99
"""


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def write_config(text: str) -> str:
    Path("own.toml").write_text(text, encoding="utf-8")
    return "own.toml"


def test_config_file_overrides_its_preset():
    expected = find_preset("long").changed(graph="f", num_envs=32, gamma=1.0, features=("view", "goal"), drop_key=True)
    expected = expected.changed(meta_ppo=replace(META_PPO, gamma=0.99))
    assert read_config(write_config(OWN)) == expected
    assert parse(["--config", "own.toml"]).config == expected
    assert read_config(write_config("")) == TrainConfig()


def test_command_line_overrides_file_and_file_overrides_preset():
    write_config(OWN)
    config = parse(["--config", "own.toml", "--gamma", "0.5", "--preset", "paper", "--no-drop-key"]).config
    assert (config.preset, config.steps, config.ppo.learning_rate) == ("paper", 10_000_000, 2.5e-4)
    assert (config.ppo.gamma, config.num_envs, config.meta_ppo.gamma) == (0.5, 32, 0.99)
    assert not config.env.drop_key
    assert config == read_config("own.toml", preset="paper", gamma=0.5, drop_key=False)


def test_reward_none_restores_the_methods_reward():
    assert parse(["--config", write_config('reward = "bonus"')]).config.env.reward == "bonus"
    assert parse(["--config", "own.toml", "--reward", "None"]).config.env.reward is None
    assert read_config(write_config('reward = "mine:Reward"')).env.reward == "mine:Reward"


def test_learned_meta_implies_learned_preset_in_escape_rooms():
    learned = find_preset("learned")
    assert read_config(write_config('meta = "learned"')) == learned
    assert parse(["--config", "own.toml", "--meta", "random"]).config == TrainConfig().changed(meta="random")
    write_config("num_envs = 128")
    assert parse(["--config", "own.toml", "--meta", "learned"]).config == learned
    write_config('meta = "learned"\npreset = "default"')
    assert read_config("own.toml") == TrainConfig().changed(meta="learned")
    write_config('task = "workshop:4"')
    assert read_config("own.toml", meta="learned").preset == "default"
    assert parse(["--config", "own.toml", "--meta", "learned"]).config.preset == "default"
    assert parse(["--task", "workshop:4", "--meta", "learned"]).config.preset == "default"


@pytest.mark.parametrize("entry", ['levels = "evaluation"', "env_index = 1"])
def test_config_file_refuses_levels_and_env_index(entry):
    with pytest.raises(InputError, match=f"there is no entry '{entry.split()[0]}'; "):
        read_config(write_config(entry))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gama = 1", "there is no entry 'gama'; is it gamma?"),
        ("num-envs = 8", "there is no entry 'num-envs'; is it num_envs?"),
        ("[meta_ppo]\ngam = 1", "there is no entry 'meta_ppo.gam'; is it meta_ppo.gamma?"),
        ("[ppo]\ngamma = 1", "entries stand alone, as on the command line; leave out the table [ppo]"),
        ("meta_ppo = 1", "meta_ppo must be a table of entries, [meta_ppo], not 1"),
        ('"two\\nlines" = 1', "there is no entry 'two\\nlines'; there are "),
        (f"gamma = {10**400}", "gamma must be a number from 0 to 1, not 1000"),
        ('gamma = "high"', "gamma must be a number from 0 to 1, not 'high'"),
        ("steps = 1e-3", "steps must be a whole number from 1 to 1,000,000,000,000,000, not 0.001"),
        ("graph = 3", "graph must be a text or a table or a list, each a text or a table, not 3"),
        ("seed = 2020-01-01", "seed must be a whole number from 0 to 2**63 - 1, not datetime.date(2020, 1, 1)"),
        ('preset = "best"', "preset must be one of default, "),
        ("[meta_ppo]\ngamma = 1.5", "meta_ppo.gamma must be a number from 0 to 1, not 1.5"),
    ],
)
def test_invalid_entry_error_names_the_config_file(text, said):
    with pytest.raises(InputError) as caught:
        train(["--config", write_config(text)])
    assert str(caught.value).startswith(f"own.toml: {said}")
    assert "\n" not in str(caught.value)
    assert [path.name for path in Path().iterdir()] == ["own.toml"]


def test_config_file_without_entries_gives_a_warning():
    for read in (read_config, read_plan):
        warn_once.cache_clear()
        Path("maze.toml").write_text("#####\n#@rRE#\n", encoding="utf-8")
        with pytest.warns(UserWarning, match=r"^maze.toml has no entries, such as "):
            read(Path("maze.toml"))


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("nowhere.toml", "cannot read the config nowhere.toml: No such file or directory"),
        (".", ". is a folder; a config is a TOML file or, to repeat a run, its config.json"),
        ("broken.toml", "broken.toml is not a TOML file: "),
        ("deep.toml", "deep.toml is not a TOML file: "),
        ("binary.toml", "cannot read the config binary.toml: it is no text in UTF-8: "),
        ("config.json", ". is not a run folder: it has no config.json"),
        ("other.json", "other.json: the config of a run is read from its folder, where it is called config.json"),
    ],
)
def test_unreadable_config_file_raises_input_error(path, said):
    Path("broken.toml").write_text("gamma = ", encoding="utf-8")
    Path("deep.toml").write_text("x = " + "[" * 10_000, encoding="utf-8")
    Path("binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError) as caught:
        train(["--config", path])
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("graph", ["a", "mine.toml", "hitting_time:8..13"])
def test_a_run_is_repeated_from_its_folder(graph, tmp_path):
    GoalGraph((0, 1, 1), 3).to_toml("mine.toml")
    write_config(f'size = 13\nnum_envs = 4\nminibatches = 2\ngraph = "{graph}"\npreset = "paper"')
    _, first = session.begin(parse(["--config", "own.toml"]).config, None)
    Path("mine.toml").unlink()
    Path("own.toml").unlink()
    _, second = session.begin(parse(["--config", str(first.path / "config.json")]).config, None)
    assert second.path != first.path
    assert second.config() == first.config()
    assert second.config().preset == "paper"
    _, third = session.begin(read_config(second.path / "config.json", seed=7), None)
    assert third.config() == first.config().changed(seed=7)


def test_config_entry_names_are_unique():
    """Entries are flat in a file, so no two parts of a config may use one name."""
    config = TrainConfig()
    names = [field.name for part in (config.env, config.agents, config.ppo, config) for field in fields(part)]
    assert len(names) == len(set(names))


def test_preset_of_a_config_cannot_be_changed(tmp_path):
    config = find_preset("default")
    with pytest.raises(InputError, match="one from default cannot be changed to large"):
        config.changed(preset="large")
    folder = RunFolder.create(tmp_path / "run", config)
    with pytest.raises(InputError, match="cannot be changed to large"):
        read_config(folder.path / "config.json", preset="large")
    assert read_config(folder.path / "config.json", preset="default", seed=3) == config.changed(seed=3)
