"""The provenance of a run: commands, versions, machine and commits, and nothing secret."""

import hashlib
import os
import shlex
import sys
from contextlib import redirect_stderr
from datetime import UTC, datetime
from importlib.metadata import version
from io import StringIO
from pathlib import Path

import pytest
from children import run_child

import hierroom
from hierroom.goals import GoalGraph
from hierroom.runs import session
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import describe_git, read_sessions, record_session
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512).changed(minibatches=2)
META = "def first(level):\n    return level.legal_goals[0]\n"
BEGIN = "--graph graph.toml --size 11 --max-steps 60 --num-envs 8 --minibatches 2 --steps 512 --meta mine_of_run:first"
BEGIN += " --evaluations 2 --evaluation-episodes 8"
RESUME = "--resume 'my run' --steps 1024 --trust-run"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run that one command began and another resumed, with a user's module and goal graph."""
    folder = tmp_path_factory.mktemp("commands")
    (folder / "mine_of_run.py").write_text(META, encoding="utf-8")
    GoalGraph((0, 1, 1), 3).to_toml(folder / "graph.toml")
    with pytest.MonkeyPatch.context() as patch, redirect_stderr(StringIO()) as said:
        patch.chdir(folder)
        patch.setattr(sys, "path", [*sys.path])  # finding a module may add to it
        for words in ([*BEGIN.split(), "--out", "my run"], shlex.split(RESUME)):
            patch.setattr(sys, "orig_argv", [sys.executable, "-m", "hierroom", "train", *words])
            assert train(words) == 0
    assert "warning" not in said.getvalue()
    return folder / "my run"


def test_provenance_lists_each_command_of_a_run(run):
    began, resumed = read_sessions(run)
    assert began["command"].endswith(f"-m hierroom train {BEGIN} --out 'my run'")
    assert resumed["command"].endswith(f"-m hierroom train {RESUME}")
    started, again = (datetime.fromisoformat(one["started"]) for one in (began, resumed))
    before = datetime.fromtimestamp(int((run.parent / "mine_of_run.py").stat().st_mtime), UTC)
    assert before <= started <= again <= datetime.now(UTC)
    assert began["folder"] == str(run.parent)
    digest = hashlib.sha256(META.encode()).hexdigest()
    assert began["modules"] == resumed["modules"]
    assert began["modules"] == [{"file": "mine_of_run.py", "sha256": digest, "copy": "modules/mine_of_run.py"}]
    assert (run / "modules" / "mine_of_run.py").read_text(encoding="utf-8") == META


def test_docs_list_every_file_of_a_run(run):
    page = (Path(hierroom.__file__).parents[1] / "docs" / "runs.md").read_text()
    for path in run.iterdir():
        listed = "events.out.tfevents.*" if path.name.startswith("events") else f"{path.name}{'/' * path.is_dir()}"
        assert f"| `{listed}` |" in page, listed
    for entry in read_sessions(run)[0]:
        assert f"`{entry}`" in page, entry


def test_provenance_records_versions_and_machine(run):
    listed = read_sessions(run)[0]
    assert listed["hierroom"]["version"] == hierroom.__version__
    assert listed["packages"]["torch"] == version("torch")
    assert set(listed["packages"]) == {"numba", "numpy", "scipy", "torch", "gymnasium", "pettingzoo"}
    assert listed["python"] == ".".join(map(str, sys.version_info[:3]))
    assert listed["cpu"]
    assert listed["gpu"] is None


def git(*arguments: str) -> str:
    identity = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false"]
    env = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    return run_child(["git", *identity, *arguments], check=True, env=env).stdout


def commit_files(*names: str) -> None:
    git("init", "-q")
    for name in names:
        Path(name).write_text("1", encoding="utf-8")
    git("add", *names)
    git("commit", "-qm", "one")


def test_describe_git_gives_commit_and_is_dirty(tmp_path, monkeypatch):
    assert describe_git(tmp_path) is None
    git("init", "-q")
    assert describe_git(tmp_path) is None  # no commit yet
    Path("file").write_text("1", encoding="utf-8")
    git("add", "file")
    git("commit", "-qm", "one")
    commit = git("rev-parse", "HEAD").strip()
    assert describe_git(tmp_path) == {"commit": commit, "is_dirty": False}
    Path("runs").mkdir()
    Path("runs/of-no-concern").write_text("2", encoding="utf-8")
    assert describe_git(tmp_path / "runs") == {"commit": commit, "is_dirty": False}
    Path("file").write_text("3", encoding="utf-8")
    assert describe_git(tmp_path) == {"commit": commit, "is_dirty": True}
    assert describe_git(tmp_path, "file") == {"commit": commit, "is_dirty": True}
    assert describe_git(tmp_path / "runs", "of-no-concern") is None  # installed into another project's checkout
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "nowhere"))  # as within a hook
    assert describe_git(tmp_path) == {"commit": commit, "is_dirty": True}
    monkeypatch.setenv("PATH", "")
    assert describe_git(tmp_path) is None


def test_describe_git_runs_no_program_of_the_checkout(tmp_path):
    """Its config may name filters and monitors, which somebody who unpacked an archive did not choose."""
    commit_files("file", "other")
    assert describe_git(tmp_path)["is_dirty"] is False
    names = ["filter.x.clean", "filter.x.process", "core.fsmonitor", "core.sshCommand", "diff.external"]
    for name in names:
        git("config", name, f"touch {tmp_path}/ran; cat")
    git("config", "filter.x.required", "true")
    (tmp_path / ".git" / "included").write_text(f'[filter "y"]\n\tclean = touch {tmp_path}/ran; cat\n')
    git("config", "include.path", "included")
    (tmp_path / ".git" / "info" / "attributes").write_text("file filter=x\nother filter=y\n")
    for file in ("file", "other"):
        Path(file).write_text("2", encoding="utf-8")  # as long as it was, so that git has to read it
    run_child(["git", "status"], cwd=tmp_path, text=False)
    assert Path("ran").exists()  # git itself runs them
    Path("ran").unlink()
    assert describe_git(tmp_path)["is_dirty"] is True
    assert not Path("ran").exists()
    git("config", "filter.a=b.clean", f"touch {tmp_path}/ran; cat")
    assert describe_git(tmp_path) is None
    assert not Path("ran").exists()


def test_run_folder_contains_no_secret(tmp_path, monkeypatch):
    commit_files("file")
    git("remote", "add", "origin", "https://user:hunter2@example.com/x.git")
    monkeypatch.setenv("MY_TOKEN", "hunter3")
    _, folder = session.begin(SMALL, tmp_path / "run")
    written = b"".join(path.read_bytes() for path in folder.path.rglob("*") if path.is_file())
    assert b"hunter" not in written
    assert read_sessions(folder.path)[0]["git"]["is_dirty"] is False


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"sessions": 1}', '{"sessions": [1]}', '{"sessions": [{}]}'])
def test_broken_provenance_raises_input_error(text, tmp_path):
    Path("provenance.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"provenance\.json") as caught:
        record_session(tmp_path, SMALL)
    assert "\n" not in str(caught.value)
    assert Path("provenance.json").read_text(encoding="utf-8") == text
