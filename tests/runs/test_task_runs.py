"""Runs of a task: each method trains on it, and all commands take them like runs in EscapeRooms."""

import json
import os
import pickle
import re
import signal
from dataclasses import replace
from pathlib import Path

import chest_task
import numpy as np
import pytest
from children import run_python
from same_run import differences
from stopped_run import stop_at_update

import hierroom
from hierroom.commands import evaluate, report, watch
from hierroom.lab.sweep.plan import read_plan
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import find_preset
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.user_code import named_code
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.train import parse
from hierroom.worlds.make import find_task

TESTS = Path(__file__).parents[1]
SMALL = ["--num-envs", "4", "--sequence-length", "8", "--minibatches", "2", "--epochs", "1", "--hidden-size", "8"]
SMALL += ["--steps", "256", "--evaluations", "2", "--evaluation-episodes", "4", "--threads", "1", "--log", "none"]
LEARNED = ["--meta", "learned", "--meta-start-success", "0", "--meta-ppo.sequence-length", "2"]
LEARNED += ["--meta-ppo.sequences-per-update", "2", "--meta-ppo.minibatches", "2"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run on arrays, and one on categories alone."""
    folder = tmp_path_factory.mktemp("runs")
    for name in ("chest", "lake"):
        assert train(["--task", f"chest_task:{name}", *SMALL, "--out", str(folder / name)]) == 0
    return folder


@pytest.mark.parametrize(
    "options",
    [
        ["--method", "ppo-rnd"],
        LEARNED,
        ["--meta", "random", "--goal-mask", "existing", "--subgoal-horizon", "5"],
        ["--reward", "chest_task:hurry"],
        *(pytest.param(["--method", name], marks=pytest.mark.slow) for name in ("ppo", "ppo-bonus", "ppo-sketch")),
        pytest.param(["--meta", "none"], marks=pytest.mark.slow),
        pytest.param(["--reward", "bonus", "--max-steps", "12"], marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_each_method_trains_on_a_task(options, tmp_path):
    assert train(["--task", "chest_task:lake", *options, *SMALL, "--film=False", "--out", str(tmp_path / "run")]) == 0
    rows = RunFolder.open(tmp_path / "run").evaluations.read()
    assert [row["graph"] for row in rows] == ["frozen lake"] * 3
    assert {"achieved_half", "achieved_gift"} <= rows[0].keys()


def test_stopped_run_of_a_task_resumes_exactly(runs, tmp_path, monkeypatch):
    stop_at_update(monkeypatch, signal.SIGINT, 3)
    out = str(tmp_path / "chest")
    assert train(["--task", "chest_task:chest", *SMALL, "--out", out]) == 130
    assert train(["--resume", out, "--trust-run", "--log", "none"]) == 0
    assert differences(runs / "chest", tmp_path / "chest") == []


def test_resumed_random_task_begins_new_episodes_with_a_note(tmp_path, monkeypatch, capsys):
    stop_at_update(monkeypatch, signal.SIGINT, 3)
    out = str(tmp_path / "run")
    assert train(["--task", "chest_task:dice", *SMALL, "--num-envs", "16", "--steps", "512", "--out", out]) == 130
    assert train(["--resume", out, "--trust-run", "--log", "none"]) == 0
    assert "episodes of chest_task:dice begin anew" in capsys.readouterr().out


@pytest.mark.parametrize(("name", "shown"), [("chest", "chest_task:chest"), ("lake", "frozen lake")])
def test_evaluate_watch_and_report_take_task_runs(name, shown, runs, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = [str(runs / name), "--trust-run"]
    assert evaluate.main([*run, "--episodes", "4", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)["sampled"]
    assert [*result["graphs"]] == [shown]
    assert result["length_over_shortest"] is None
    for suffix in (".gif", ".json", ".txt"):
        assert watch.main([*run, "--out", f"one{suffix}"]) == 0
    (episode,) = json.loads((tmp_path / "one.json").read_text())
    assert episode["graph"] == shown
    assert (tmp_path / "one.txt").read_text().startswith(f"task {shown}, seed 0, ")
    assert evaluate.main([*run, "--episodes", "4"]) == 0
    assert report.main([*run, "--episodes", "1", "--played", "4"]) == 0
    page = (tmp_path / "report.html").read_text()
    said = capsys.readouterr().out + re.sub(r"<(script|style).*?</\1>|<[^>]*>", " ", page, flags=re.DOTALL)
    said += (tmp_path / "one.txt").read_text()
    of_rooms = re.findall(r"\b(?:escap\w*|rooms?|keys?|doors?|graphs?|exit(?! depth))\b", said, re.IGNORECASE)
    assert {*of_rooms} <= {*getattr(chest_task, name).goals}
    with pytest.raises(InputError, match=r"^the oracle needs a world that knows its shortest ways"):
        evaluate.main([*run, "--meta", "oracle"])
    with pytest.raises(InputError, match=f"^graph is for EscapeRooms; chest_task:{name} has no such entry$"):
        evaluate.main([*run, "--graph", "c"])
    assert page.count("data:image/gif;base64,R0lG") == 1
    assert page.count(f"on task {shown}, seed 0") == 1
    assert (f'<th scope="row">{shown}</th>' in page) == (getattr(chest_task, name).rules is not None)


@pytest.mark.slow
def test_task_in_several_processes_ends_cleanly(tmp_path):
    """The processes start while the run handles signals, and inherit its handlers."""
    words = ["-m", "hierroom", "train", "--task", "chest_task:split", *SMALL, "--out", tmp_path / "run"]
    done = run_python(*words, env={**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS.parent), str(TESTS)])})
    assert (done.returncode, done.stderr) == (0, "")


def test_failing_render_loses_no_results(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(chest_task.Chest, "render", lambda self: 1 / 0)
    monkeypatch.setattr(chest_task, "chest", replace(chest_task.chest))  # a task asks once whether it can be drawn
    assert train(["--task", "chest_task:chest", *SMALL, "--out", str(tmp_path / "run")]) == 0
    assert "there is no film of an episode: the environment cannot be drawn" in capsys.readouterr().err
    assert (tmp_path / "run" / "summary.json").is_file()


def test_task_agent_plays_from_python_if_trusted(runs):
    agent = hierroom.load(runs / "chest", trust=True)
    episodes = list(hierroom.rollout(agent, episodes=3))
    assert [len(episode) for episode in episodes] == [len(one) for one in hierroom.rollout(agent, episodes=3)]
    with pytest.raises(InputError, match="names code that does not ship with hierroom: task 'chest_task:chest'"):
        hierroom.load(runs / "chest")


def test_train_takes_the_task_itself_and_stores_its_name(tmp_path):
    entries = {"num_envs": 4, "sequence_length": 8, "minibatches": 2, "epochs": 1, "hidden_size": 8, "steps": 32}
    agent = hierroom.train(task=chest_task.chest, out=tmp_path / "run", log="none", evaluations=0, **entries)
    assert agent.config.env.task == "chest_task:chest"
    assert agent.config.env.max_steps is None
    assert repr(agent).startswith("<TrainedAgent hippo-fixed-dfs-chest_task-chest-seed0-")


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"task": "nowhere:chest"}, "there is no module 'nowhere' for the task 'nowhere:chest'"),
        ({"task": "chest_task:GOALS"}, "the task 'chest_task:GOALS' must be a hierroom.Task, not a dict"),
        ({"task": "chest_task:gold"}, "the task 'chest_task:gold' cannot be loaded: AttributeError: "),
        ({"task": "chest_task:chset"}, "has no attribute 'chset' (is it chest?)"),
        ({"task": "workshopp:4"}, "there is no module 'workshopp' for the task 'workshopp:4' (is it workshop?)"),
        ({"task": "chest_task:chest", "method": "ppo-rnd"}, "the curiosity of ppo-rnd reads categories"),
        (
            {"task": "chest_task:chest", "method": "ppo-novelty"},
            "asks for: visited; ppo-rnd rewards novelty",
        ),
    ],
)
def test_invalid_task_entries_raise_input_error(entries, said):
    with pytest.raises(InputError) as refused:
        Trainer(find_preset("default").changed(num_envs=4, **entries)).turns.meta_masks()
    assert said in str(refused.value)


@pytest.mark.parametrize(("name", "value"), [("graph", "c"), ("size", "19"), ("curriculum_stages", "1")])
@pytest.mark.parametrize(("world", "spec"), [("task", "workshop:4"), ("layout", "mine.txt")])
def test_entry_for_another_world_is_refused_even_with_its_default(world, spec, name, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.txt").write_text("######\n#@rRE#\n######")
    quoted = value if value.isdecimal() else f'"{value}"'
    (tmp_path / "own.toml").write_text(f'{world} = "{spec}"\n{name} = {quoted}')
    why = "is for EscapeRooms; workshop:4 has no such entry$"
    if world == "layout":
        why = "is for levels that are drawn; the layout mine is fixed$|are both given"
    why += "|^a trained agent cannot be played with another curriculum_stages$"
    for ask in (
        lambda: parse([f"--{world}", spec, f"--{name}", value]),
        lambda: parse([f"--{world}", spec, f"--{name.replace('_', '-')}", value]),
        lambda: parse(["--config", "own.toml"]),
        lambda: read_plan(None, [f"{world}={spec}", f"{name}={value}"]).runs(),
        lambda: hierroom.load("a").env(**{world: spec, name: read_plan(None, [f"{name}={value}"]).values[name][0]}),
    ):
        with pytest.raises(InputError, match=f"{why}|cannot be played with another curriculum_stages"):
            ask()
    assert parse(["--task", "None", f"--{name}", value]).config == TrainConfig()


def test_config_of_task_stores_name_and_no_features():
    config = find_preset("learned").changed(task="chest_task:chest")
    assert (config.agents.features, config.agents.meta_features, config.env.max_steps) == (None, None, None)
    assert named_code(config) == {"task": "chest_task:chest"}
    assert TrainConfig.from_dict(config.to_dict()) == config
    assert config.changed(task="chest_task:lake", max_steps=9).env.max_steps == 9
    with pytest.raises(InputError, match="a run names its task"):
        find_preset("default").changed(task=chest_task.chest).to_dict()
    old = config.changed(task=None).to_dict()
    del old["env"]["task"]  # as of a version before there were tasks
    assert TrainConfig.from_dict(old).env.task is None


def test_training_and_evaluation_episodes_differ():
    config = find_preset("default").changed(task="chest_task:chest", num_envs=4)
    trainer = Trainer(config)
    noise = trainer.turns.world.shown(np.arange(4))["observation_goal"]
    others = trainer.fresh_turns(4, config.seed).world.shown(np.arange(4))["observation_goal"]
    assert not (noise == others).any()


def test_task_has_one_name_in_titles_and_messages():
    named = chest_task.chest, pickle.loads(pickle.dumps(chest_task.chest)), find_task("chest_task:chest")
    labelled, nowhere = replace(chest_task.chest, label="a chest"), replace(chest_task.chest)
    for expected, tasks in (("chest_task:chest", named), ("a chest", [labelled]), ("task", [nowhere])):
        assert {task.name for task in tasks} == {expected}
        assert {hierroom.env(task=task).unwrapped.complexity.name for task in tasks} == {expected}
