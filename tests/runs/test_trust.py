"""Code is run where the user names it or agrees, never because a run folder says so."""

import json
import sys
from pathlib import Path

import pytest

import hierroom
from hierroom.commands.evaluate import main as evaluate
from hierroom.commands.watch import main as watch
from hierroom.lab.compare.evaluated_run import read_run
from hierroom.meta import make_meta
from hierroom.runs import session
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import user_code
from hierroom.runs.folder.config_file import read_config
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.learning_curve import evaluation_rows
from hierroom.runs.trained_agent import load
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.train import parse
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=30), num_envs=4, steps=512).changed(minibatches=2, hidden_size=8)
CODE = """
from pathlib import Path

import numpy as np

Path("ran").touch()


class Code:
    def choose(self, observations, legal, situation):
        return legal.argmax(axis=1)

    def rewards(self, step):
        return np.zeros(len(step.rewards))
"""
PARTS = {"meta": "agents", "network": "agents", "reward": "env"}
CALLS = {
    "evaluate": lambda: evaluate(["run", "--episodes", "2"]),
    "watch": lambda: watch(["run", "--text"]),
    "resume": lambda: train(["--resume", "run"]),
    "repeat": lambda: train(["--config", "run/config.json", "--out", "other"]),
    "load": lambda: load("run"),
    "read_config": lambda: read_config("run/config.json"),
}


@pytest.fixture
def run(tmp_path, monkeypatch) -> RunFolder:
    """A run, and next to it and within it a module that leaves a file behind when imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    trainer, folder = session.begin(SMALL, Path("run"))
    folder.lock.release()
    folder.evaluations.append(evaluation_rows(0, 0.0, trainer.evaluate()))
    for name in ("code.py", "run/code.py"):
        Path(name.replace("code", "planted")).write_text(CODE, encoding="utf-8")
    yield folder
    sys.modules.pop("planted", None)
    sys.modules.pop("run.planted", None)


def plant(entry: str, spec: str) -> None:
    path = Path("run/config.json")
    config = json.loads(path.read_text(encoding="utf-8"))
    config[PARTS[entry]][entry] = spec
    path.write_text(json.dumps(config), encoding="utf-8")


def test_trusted_folder_uses_its_module_copies(run, tmp_path, monkeypatch):
    plant("meta", "planted:Code")
    (tmp_path / "run" / "modules" / "session-2").mkdir(parents=True)
    Path("planted.py").rename("run/modules/session-2/planted.py")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="it is run only if you trust it"):
        load("../run")
    with pytest.raises(InputError, match=f"for the meta-controller 'planted:Code'; it is looked for in .*{tmp_path}"):
        make_meta("planted:Code")
    config = read_config("../run/config.json", trust=True)
    assert type(make_meta(config.agents.meta)).__name__ == "Code"


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("entry", PARTS)
def test_no_command_runs_code_named_in_a_folder(run, entry, call):
    for spec in ("planted:Code", "run.planted:Code"):
        plant(entry, spec)
        with pytest.raises(InputError, match=f"run names code that does not ship .*: {entry} '{spec}'; .* --trust-run"):
            CALLS[call]()
    assert not Path("ran").exists()
    assert not Path("other").exists()
    assert not {"planted", "run.planted"} & sys.modules.keys()


@pytest.mark.parametrize("spec", ["hierroom.train:main", "hierroom.meta:FixedDFS", "another-name", "http.server:test"])
def test_named_code_includes_other_names_and_functions_of_hierroom(spec):
    assert user_code.named_code(SMALL.changed(meta=spec)) == {"meta": spec}
    for meta in ("fixed-dfs", "learned", "random", None):
        assert user_code.named_code(SMALL.changed(meta=meta)) == {}


def test_read_run_runs_no_code(run):
    plant("reward", "planted:Code")
    assert read_run(run.path).reward == "planted:Code"
    assert not Path("ran").exists()


@pytest.mark.parametrize("argument", ["--trust-run", "--trust_run", "--meta=planted:Code"])
@pytest.mark.parametrize("call", ["--resume=run", "--config=run/config.json"])
def test_run_with_user_code_resumes_if_trusted_or_named(run, argument, call):
    _, own = session.begin(SMALL.changed(meta="planted:Code"), Path("own"))
    with pytest.raises(InputError, match="--trust-run"):
        parse([call.replace("run", "own", 1)])
    assert parse([call.replace("run", "own", 1), argument]).config == own.config()
    agent = load("own", trust=True)
    assert agent.config == own.config()
    assert load("own", meta="random").steps == 0  # the run's meta-controller is not needed
    with pytest.raises(InputError, match="meta 'planted:Code'"):
        load("own")


def test_naming_other_code_does_not_trust_a_run(run):
    plant("reward", "planted:Code")
    with pytest.raises(InputError, match="reward 'planted:Code'"):
        parse(["--config", "run/config.json", "--meta", "planted:Code"])
    with pytest.raises(InputError, match="reward 'planted:Code'"):
        load("run", meta="fixed-dfs")
    assert not Path("ran").exists()


def test_trust_option_is_given_for_user_code():
    assert user_code.trust_option(SMALL) == ()
    assert user_code.trust_option(SMALL.changed(reward="planted:Code")) == ("--trust-run",)


def test_train_runs_code_named_in_the_call(run):
    agent = hierroom.train(SMALL, meta="planted:Code", out="python", steps=64, sequence_length=8, evaluations=0)
    assert agent.config.agents.meta == "planted:Code"
    assert Path("ran").exists()
