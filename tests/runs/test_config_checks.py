"""Checks of a run's config: types, ranges, and changes since training."""

import json

import numpy as np
import pytest

import hierroom
from hierroom.runs import session
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import PRESETS
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trained_agent import load
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError, one_line
from hierroom.train import main
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=30), num_envs=4, steps=512).changed(minibatches=2, hidden_size=8)


@pytest.fixture
def run(tmp_path) -> RunFolder:
    folder = session.begin(SMALL, tmp_path / "run")[1]
    folder.lock.release()  # as the end of its session does
    return folder


def edit(run: RunFolder, part: str | None, name: str, value: object) -> None:
    path = run.path / "config.json"
    table = json.loads(path.read_text())
    (table[part] if part else table)[name] = value
    path.write_text(json.dumps(table))


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [(None, "seed", 1), ("ppo", "gamma", 0.5), ("env", "graph", ["b"]), ("meta_ppo", "gamma", 0.5)],
)
def test_config_changed_since_training_raises_input_error(run, part, name, value):
    edit(run, part, name, value)
    shown_name = f"meta_ppo.{name}" if part == "meta_ppo" else name
    for use in (lambda: session.resume(run.config(), run.path), lambda: load(run.path)):
        with pytest.raises(InputError, match=rf"has changed since the run was trained: {shown_name} is .* and was"):
            use()


@pytest.mark.parametrize(("name", "value"), [("steps", 1024), ("threads", 1), ("device", "cpu")])
def test_steps_threads_and_device_may_change(run, name, value):
    edit(run, None, name, value)
    session.resume(run.config(), run.path)[1].lock.release()


@pytest.mark.parametrize(
    ("part", "name", "value", "said"),
    [
        ("ppo", "gamma", "0.9", "Expected `float`, got `str` - at `$.ppo.gamma`"),
        ("ppo", "learning_rate", float("inf"), "Expected `float` <= 1.7976931348623157e+308 - at `$.ppo."),
        ("env", "drop_key", 1, "Expected `bool`, got `int` - at `$.env.drop_key`"),
        ("env", "graph", ["mine.toml"], "goal graphs must be given by content or by a letter, not as 'mine.toml'"),
        ("agents", "features", "view", "Expected `array | null`, got `str` - at `$.agents.features`"),
        (None, "seed", -1, "Expected `int` >= 0 - at `$.seed`"),
        (None, "num_envs", 2**40, "Expected `int` <= 1048576 - at `$.num_envs`"),
        (None, "ppo", 3, "Expected `object`, got `int` - at `$.ppo`"),
        (None, "sed", 3, "Object contains unknown field `sed`"),
    ],
)
def test_invalid_edited_config_raises_input_error(run, part, name, value, said):
    edit(run, part, name, value)
    with pytest.raises(InputError) as caught:
        run.config()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 10**5, "9" * 5000, '{"env": NaN', r'{"seed": "\udcff"}', "", "[]", "null"])
def test_malformed_config_json_raises_input_error(run, text):
    (run.path / "config.json").write_text(text)
    with pytest.raises(InputError, match=r"config\.json") as caught:
        run.config()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("learning_rate", float("inf")), ("value_weight", float("inf")), ("clip", float("nan")), ("gamma", "0.9")),
        *(("sequence_length", 10**18), ("hidden_size", 10**8), ("minibatches", 1.5), ("epochs", True), ("threads", 0)),
        *(("num_envs", 10**20), ("num_envs", -1), ("seed", 2**63), ("curiosity_weight", float("inf")), ("device", 3)),
    ],
)
def test_out_of_range_config_entry_raises_input_error(name, value):
    with pytest.raises(InputError, match=f"{name} must be"):
        SMALL.changed(**{name: value})


def test_repeating_run_with_broken_provenance_leaves_no_folder(run, tmp_path):
    (run.path / "provenance.json").write_text('{"sessions": 3}')
    with pytest.raises(InputError, match="it lists no sessions"):
        main(["--config", str(run.path / "config.json"), "--out", str(tmp_path / "new"), "--log", "none"])
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", ["features", "meta_features"])
def test_a_list_of_features_is_the_same_config_as_a_tuple(name):
    usual = getattr(SMALL.agents, name)
    assert SMALL.changed(**{name: [*usual]}) == SMALL
    assert hash(SMALL.changed(**{name: [*usual]})) == hash(SMALL)
    in_shop = TrainConfig().changed(task="workshop:4")
    assert in_shop.changed(**{name: [*usual]}) == in_shop.changed(**{name: usual}) != in_shop


@pytest.mark.parametrize("episodes", [0, -1, 1.5, True, "3"])
def test_trainer_evaluate_with_invalid_episodes_raises_input_error(episodes):
    with pytest.raises(InputError, match=r"^episodes must be (at least 1|a whole number), not"):
        Trainer(SMALL).evaluate(episodes)


@pytest.mark.parametrize("device", ["meta", "hpu", "nonsense", "cuda:99", "cpu:7x"])
def test_unusable_device_raises_input_error(device):
    with pytest.raises(InputError, match=f"has no device {device!r} to compute on"):
        Trainer(SMALL.changed(device=device))


@pytest.mark.parametrize(
    ("entry", "value", "said"),
    [
        ("stagger_clocks", 0, "stagger_clocks must be True or False, not 0"),
        ("features", 3, "features are given as a list of names, not as 3"),
        ("features", ("view", "goal", "view"), "features has view twice; name each once"),
        ("novelty_bonus", True, "novelty_bonus must be a number from 0 to 1,000,000, not True"),
        ("network", None, r"network must be a text, not None"),
        ("network", "", "network must be a name, not an empty text"),
        ("env", {"graph": "c"}, "env must be of type EnvConfig, not a dict"),
    ],
)
def test_invalid_config_entry_is_refused_before_training(entry, value, said, tmp_path):
    with pytest.raises(InputError, match=said):
        hierroom.train(SMALL.changed(**{entry: value}), out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_config_stores_numpy_numbers_and_paths_as_plain(tmp_path, run):
    numbers = {"seed": np.int64(1), "steps": np.int32(512), "size": np.uint8(11), "drop_key": np.bool_(False)}
    config = SMALL.changed(**numbers, learning_rate=np.float32(0.001), warm_start=run.path)
    _, folder = session.begin(config, tmp_path / "of_numpy")
    folder.lock.release()
    read = folder.config()
    assert [type(read.entries[name]) for name in numbers] == [int, int, int, bool]
    assert read.warm_start == str(run.path)


@pytest.mark.parametrize("name", ["two\nlines", "\x1b[31mred", "\udcff", "x" * 5000, "\u2028"])
def test_one_line_gives_short_printable_text(name):
    line = one_line(f"error: there is no {name}")
    assert line.isprintable()
    assert len(line) < 1100
    line.encode()


def test_config_with_missing_entry_raises_input_error():
    table = SMALL.to_dict()
    assert TrainConfig.from_dict(table) == SMALL
    for part, entry in (("ppo", "gamma"), ("env", "subgoal_horizon")):
        lacking = {name: value for name, value in table[part].items() if name != entry}
        with pytest.raises(InputError, match=rf"missing required field `{entry}` - at `\$\.{part}`$"):
            TrainConfig.from_dict({**table, part: lacking})


def test_paper_preset_matches_section_3():
    paper = PRESETS["paper"]
    assert (paper.steps, paper.num_envs, paper.env.max_steps) == (10_000_000, 128, 1000)
    assert (paper.ppo.hidden_size, paper.ppo.learning_rate) == (64, 2.5e-4)
    assert (paper.ppo.gamma, paper.ppo.gae_lambda) == (0.9, 0.95)
    assert paper.agents.features == ("view-ids", "goal")


def test_ppo_with_goal_features_alone_raises_input_error():
    with pytest.raises(InputError, match=r"ppo does not see goals, so features must name more than goal, symbol$"):
        Trainer(SMALL.changed(method="ppo", features=("goal", "symbol")))
