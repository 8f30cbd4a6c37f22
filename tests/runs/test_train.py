"""Training, resuming and evaluating, as a user would: through the commands."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pictures
import pytest
from children import run_child
from run_contents import check_picture, check_run
from same_state import equal

from hierroom.agents.config import METHODS, AgentsConfig
from hierroom.commands import evaluate
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.checkpoint import CHECKPOINT_FORMAT, TABLES
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.support.files import to_json
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(
    EnvConfig("a", size=11, max_steps=60),
    num_envs=8,
    steps=2048,
    ppo=PPOConfig(sequence_length=16, minibatches=2, epochs=2),
)
FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8"]
FLAGS += ["--sequence-length", "16", "--minibatches", "2", "--epochs", "2"]


def run(name: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "hierroom", name, *arguments]
    return run_child(command, cwd=cwd)


def without_clock(state: dict) -> dict:
    return {**state, "seconds": 0, "compile_seconds": 0}


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("trained") / "run"
    assert train([*FLAGS, "--steps", "4096", "--out", str(out)]) == 0
    return out


def test_run_writes_all_its_files(trained):
    summary = json.loads((trained / "summary.json").read_text())
    for entry in (
        "training_success_rate",
        "training_episode_length",
        "steps",
        "seconds",
        "steps_per_second",
        "steps_to_90",
    ):
        assert entry in summary
    assert summary["steps"] == 4096
    assert RunFolder.open(trained).config() == TrainConfig(
        EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=4096, ppo=SMALL.ppo
    )
    assert len(list(trained.glob("events.out.tfevents.*"))) == 1
    rows = RunFolder.open(trained).metrics.numbers()
    assert rows[-1]["steps"] == 4096
    assert [row["steps"] for row in rows] == sorted({row["steps"] for row in rows})
    assert check_run(trained) == summary
    check_picture(trained)


def test_each_checkpoint_equals_the_trainer_at_its_steps(trained):
    folder = RunFolder.open(trained)
    trainer = Trainer(folder.config())
    names = {path.name for path in folder.checkpoints.iterdir()}
    rows = [row["steps"] for row in folder.metrics.numbers()]
    assert names == {f"{n:012.0f}.pt" for n in [0, *(min(m for m in rows if m >= k * 409) for k in range(1, 11))]}
    while names:
        if (name := f"{trainer.steps:012d}.pt") in names:
            names.remove(name)
            saved = folder.load_checkpoint(trainer.steps)
            assert saved.pop("format") == CHECKPOINT_FORMAT
            n_rows = {table: len(getattr(folder, table).read()) for table in TABLES}
            assert (saved["tables"] == n_rows) == trainer.is_done
            assert saved.pop("tables")["metrics"] == sum(steps <= trainer.steps for steps in rows)
            assert equal(without_clock(saved), without_clock(trainer.state_dict()))
        if names:
            assert not trainer.is_done
            trainer.advance()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_runs_with_its_reward(method):
    trainer = Trainer(SMALL.changed(method=method, steps=512))
    while not trainer.is_done:
        trainer.advance()
    assert trainer.steps == 512
    assert ("goal" in trainer.controller.features.names) == METHODS[method].sees_goal
    rewards = {"hippo": "intrinsic", "ppo-bonus": "bonus", "ppo-novelty": "novelty"}
    assert trainer.turns.reward.name == f"the reward {rewards.get(method, 'extrinsic')!r}"
    assert (trainer.controller.curiosity is not None) == (method == "ppo-rnd")


@pytest.mark.slow
def test_curriculum_stage_is_printed_and_stored(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    flags = ["--graph", "expected_steps:20..100", "--curriculum-stages", "3", *FLAGS[2:], "--evaluations", "1"]
    assert train([*flags, "--steps", "1024", "--out", "run"]) == 0
    output = capsys.readouterr().out
    assert "stage 1 of 3" in output
    assert "stage of the curriculum" in output
    folder = RunFolder.open("run")
    assert {row["stage"] for row in folder.metrics.numbers()} == {1.0}
    summary = json.loads((folder.path / "summary.json").read_text())
    assert (summary["stage"], summary["stages"]) == (1, 3)
    graphs = {row["graph"] for row in folder.evaluations.read()}
    assert len(graphs) > 3  # of all stages


@pytest.mark.parametrize(
    "option", [["--graph", "b"], ["--preset", "paper"], ["--out", "elsewhere"], ["--config", "own.toml"]]
)
def test_resume_takes_no_other_options(trained, option):
    with pytest.raises(InputError, match="keeps its config"):
        train(["--resume", str(trained), *option])


def test_resume_with_fewer_steps_than_taken_changes_nothing(trained):
    config = (trained / "config.json").read_text()
    with pytest.raises(InputError, match=r"has taken [\d,]+ steps; --steps must be more, not 1$"):
        train(["--resume", str(trained), "--steps", "1"])
    assert (trained / "config.json").read_text() == config


@pytest.mark.parametrize("change", [{"num_envs": 9}, {"size": 13}])
def test_resume_of_mismatched_checkpoint_raises_input_error(change, tmp_path):
    other = SMALL.changed(**change)
    folder = RunFolder.create(tmp_path / "run", other)
    folder.save_checkpoint({**Trainer(SMALL).state_dict(), "config": to_json(other.to_dict())})
    with pytest.raises(InputError, match=r"does not fit its config\.json: \w"):
        train(["--resume", str(folder.path)])


def test_evaluate_prints_a_table_and_json(trained, capsys):
    words = [str(trained), "--episodes", "20"]
    assert evaluate.main(words) == 0
    assert "95% interval" in capsys.readouterr().out
    assert evaluate.main([*words, "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    for name in ("sampled", "greedy"):
        interval = results[name]["success_interval"]
        assert interval["low"] <= results[name]["success_rate"] <= interval["high"]
        assert set(results[name]["steps_to_goals"]) == {"key 1", "door 1", "exit"}


@pytest.mark.slow
def test_evaluate_shows_graphs_that_one_player_met(monkeypatch, capsys):
    """The greedy player fails more often, stops earlier, and has no episode on some graphs."""
    monkeypatch.setattr(evaluate, "MOST_EPISODES", 40)
    monkeypatch.setenv("COLUMNS", "150")
    assert evaluate.main(["a", "--graph", "rooms:6", "--num-envs", "10"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if " keys-" in line]
    assert [sum(int(line[column]) for line in lines) for column in (1, 5)] == [40, 30]  # sampled, greedy
    assert any(line[5:] == ["0", "-", "-", "-"] for line in lines)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--graph", "z"], "a graph must be a letter from a to g"),
        (["--graph", "cycle.toml"], "must form a tree"),
        (["--curriculum-stages", "3"], "needs several graphs"),
        (["--warm-start", "nowhere"], "nowhere is not a run folder"),
        (["--resume", "nowhere"], "is not a run folder"),
        (
            ["--out", "broken.toml"],
            "cannot create the run folder broken.toml: broken.toml is not a folder; choose",
        ),
        (["--out", "broken.toml/x"], "cannot create the run folder broken.toml/x: broken.toml is not a folder; choose"),
        (["--out", "."], "is not an empty folder"),
        (["--config", ""], r"^\. is a folder; a config is a TOML file or"),
        (["--resume", ""], r"^\. is not a run folder"),
    ],
)
def test_wrong_input_raises_input_error_and_writes_nothing(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text("key_rooms = [0,", encoding="utf-8")
    Path("cycle.toml").write_text("key_rooms = [2, 1]\nexit_room = 1\n", encoding="utf-8")
    before = sorted(Path().rglob("*"))
    with pytest.raises(InputError, match=said) as caught:
        train([*(FLAGS[2:] if "--graph" in arguments else FLAGS), "--steps", "512", *arguments])
    assert "\n" not in str(caught.value)
    assert sorted(Path().rglob("*")) == before


def test_run_without_escape_writes_failure_gif(tmp_path, capsys):
    out = tmp_path / "run"
    assert train([*FLAGS, "--max-steps", "5", "--steps", "128", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert f"one failure     {out / 'failure.gif'} (no escape in 20 episodes)" in said
    assert f"watch it        python -m hierroom watch {out} --failures" in said
    assert len(pictures.frames(out / "failure.gif")) == 6 + 9
    (out / "failure.gif").rename(out / "escape.gif")  # as if it had escaped before it was resumed
    assert train(["--resume", str(out), "--steps", "256"]) == 0
    assert {path.name for path in out.glob("*.gif")} == {"failure.gif"}
    assert RunFolder.open(out).config().steps == 256  # so that it can be interrupted and resumed once more
    assert check_run(out)["steps"] == 256


def test_metrics_report_illegal_goals(monkeypatch):
    trainer = Trainer(SMALL)
    assert trainer.metrics()["meta_illegal_goals"] == 0
    monkeypatch.setattr(trainer.agents["meta_0"], "act", lambda observation: np.full(len(observation), 12))
    trainer.advance()
    assert trainer.metrics()["meta_illegal_goals"] > 0.9  # the exit cannot be reached yet
    assert "meta_illegal_goals" not in Trainer(replace(SMALL, agents=AgentsConfig(method="ppo"))).metrics()
