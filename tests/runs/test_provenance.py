"""The provenance of a run: commands, versions, commits, and copies of the user's modules."""

import hashlib
import importlib
import json
import os
import re
import sys
from datetime import UTC, datetime
from importlib.metadata import EntryPoint, version
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest
from children import run_child

import hierroom
from hierroom.commands import evaluate
from hierroom.goals import GoalGraph
from hierroom.runs import session
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import own_modules
from hierroom.runs.folder.own_modules import MAX_BYTES, MAX_FILES, find_module_files, own_code_digest
from hierroom.runs.folder.provenance import (
    changed_modules,
    describe_git,
    describe_session,
    record_session,
    version_of_code,
)
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512).changed(minibatches=2)
FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8", "--minibatches", "2", "--steps", "512"]
META = "import numpy as np\n\n\nclass First:\n    def choose(self, observations, legal, situation):\n"
META += "        return legal.argmax(axis=1)\n"


def sessions(run: Path) -> list[dict]:
    return json.loads((run / "provenance.json").read_text())["sessions"]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder, whose modules are forgotten afterwards."""
    monkeypatch.chdir(tmp_path)
    before = dict(sys.modules)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    yield
    for name in sys.modules.keys() - before.keys():
        if (getattr(sys.modules[name], "__file__", None) or "").startswith(str(tmp_path)):
            del sys.modules[name]


def load(module: str, sources: dict[str, str]) -> TrainConfig:
    """Write source files, load a module, and give a config that names it as its meta-controller."""
    for name, source in sources.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(source, encoding="utf-8")
    importlib.invalidate_caches()
    importlib.import_module(module)
    return SMALL.changed(meta=f"{module}:First")


def names_of(config: TrainConfig) -> list[str]:
    return [file.name for file in find_module_files(config)]


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


def test_a_run_tells_each_command_that_worked_on_it(tmp_path):
    Path("mine.py").write_text(META, encoding="utf-8")
    python = [sys.executable, "-m", "hierroom", "train"]
    before = datetime.now(UTC).replace(microsecond=0)
    first = [*python, *FLAGS, "--meta", "mine:First", "--out", "my run"]
    run_child(first, check=True, text=False)
    then = [*python, "--resume", "my run", "--steps", "1024", "--trust-run"]
    assert b"warning" not in run_child(then, check=True, text=False).stderr
    began, resumed = sessions(Path("my run"))
    assert began["command"].endswith("-m hierroom train " + " ".join(FLAGS) + " --meta mine:First --out 'my run'")
    assert resumed["command"].endswith("-m hierroom train --resume 'my run' --steps 1024 --trust-run")
    started, again = (datetime.fromisoformat(one["started"]) for one in (began, resumed))
    assert before <= started <= again <= datetime.now(UTC)
    assert began["folder"] == str(tmp_path)
    digest = hashlib.sha256(META.encode()).hexdigest()
    assert began["modules"] == resumed["modules"]
    assert began["modules"] == [{"file": "mine.py", "sha256": digest, "copy": "modules/mine.py"}]
    assert Path("my run/modules/mine.py").read_text(encoding="utf-8") == META


def test_versions_and_machine():
    told = describe_session()
    assert told["hierroom"]["version"] == hierroom.__version__
    assert told["packages"]["torch"] == version("torch")
    assert set(told["packages"]) == {"numba", "numpy", "scipy", "torch", "gymnasium", "pettingzoo"}
    assert told["python"] == ".".join(map(str, sys.version_info[:3]))
    assert told["cpu"]
    assert told["gpu"] is None
    json.dumps(told)


def test_the_commit_and_whether_files_differ_from_it(tmp_path, monkeypatch):
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
    assert describe_git(tmp_path / "runs", "of-no-concern") is None  # installed into somebody else's checkout
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "nowhere"))  # as within a hook
    assert describe_git(tmp_path) == {"commit": commit, "is_dirty": True}
    monkeypatch.setenv("PATH", "")
    assert describe_git(tmp_path) is None


def test_a_checkout_names_no_program_that_git_runs(tmp_path):
    """Its config may name filters and monitors: who trains within an unpacked archive did not choose them."""
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


def test_the_version_of_a_checkout_tells_its_commit(tmp_path, monkeypatch):
    Path("hierroom").mkdir()
    commit_files("hierroom/__init__.py")
    monkeypatch.setattr(hierroom, "__version__", "1.2.dev3+gold")
    monkeypatch.setattr(hierroom, "__file__", str(tmp_path / "hierroom" / "__init__.py"))
    commit = describe_git(tmp_path)["commit"]
    version_of = version_of_code.__wrapped__  # what is told in a process does not change
    assert version_of() == f"1.2.dev3+g{commit[:9]}"
    Path("hierroom/__init__.py").write_text("X = 1", encoding="utf-8")
    assert version_of() == f"1.2.dev3+g{commit[:9]}.dirty"
    monkeypatch.setattr(hierroom, "__file__", "/nowhere/hierroom/__init__.py")
    assert version_of() == "1.2.dev3+gold"


def test_no_secret_is_written(tmp_path, monkeypatch):
    commit_files("file")
    git("remote", "add", "origin", "https://user:hunter2@example.com/x.git")
    monkeypatch.setenv("MY_TOKEN", "hunter3")
    _, folder = session.begin(SMALL, tmp_path / "run")
    written = b"".join(path.read_bytes() for path in folder.path.rglob("*") if path.is_file())
    assert b"hunter" not in written
    assert sessions(folder.path)[0]["git"]["is_dirty"] is False


def test_of_a_module_what_it_imports_from_its_folder_is_copied_too(tmp_path):
    sources = {
        "mine.py": "import numpy, os\nimport shared.rules\nfrom helper import *\n" + META,
        "helper.py": "def late():\n    import later\n",
        "later.py": "import mine, nowhere\n",
        "shared/__init__.py": "",
        "shared/rules.py": "from . import tables\n",
        "shared/tables.py": "",
    }
    config = load("mine", {**sources, "shared/unused.py": "", "unused.py": "", "os.py": "", "hierroom/x.py": ""})
    assert names_of(config) == sorted(sources)
    assert "later" not in sys.modules  # read, not imported
    record_session(tmp_path, config)
    copies = {path.relative_to("modules").as_posix(): path.read_text() for path in Path("modules").rglob("*.py")}
    assert copies == sources


def test_a_module_within_a_package():
    sources = {
        "lab/__init__.py": "",
        "lab/metas/__init__.py": "from . import own",
        "lab/metas/own.py": "from ..rules import X\n" + META,
        "lab/rules.py": "X = 1\n",
    }
    config = load("lab.metas.own", sources)
    assert names_of(config) == sorted(sources)
    assert names_of(config.changed(meta="lab.metas:own")) == sorted(sources)
    assert names_of(config.changed(meta=None, reward="lab.rules:X")) == ["lab/__init__.py", "lab/rules.py"]


def test_of_an_installed_package_its_own_files_alone_are_copied(monkeypatch, tmp_path):
    site = tmp_path / "site-packages"
    site.mkdir()
    monkeypatch.chdir(site)
    monkeypatch.setattr(sys, "path", [str(site), *sys.path])
    load("plugin.meta", {"plugin/__init__.py": "", "plugin/meta.py": "import other\n" + META, "other.py": ""})
    point = EntryPoint("nearest", "plugin.meta:First", "hierroom.meta_controllers")
    monkeypatch.setattr(own_modules, "entry_points", lambda name: [point] if name == "nearest" else [])
    assert names_of(SMALL.changed(meta="nearest")) == ["plugin/__init__.py", "plugin/meta.py"]


def test_what_ships_is_not_copied(tmp_path):
    for changes in ({}, {"meta": "learned"}, {"meta": "hierroom.meta:FixedDFS"}, {"graph": "hitting_time:8..13"}):
        assert find_module_files(SMALL.changed(**changes)) == []
    assert record_session(tmp_path, SMALL) == []
    assert not Path("modules").exists()


def test_what_cannot_be_copied_is_told(tmp_path):
    config = load("mine", {"mine.py": "import large, locked\n" + META, "large.py": "", "locked.py": ""})
    Path("large.py").write_bytes(b"#" * (MAX_BYTES + 1))
    Path("locked.py").unlink()
    Path("locked.py").symlink_to("/proc/self/mem")  # there, and cannot be read even by root
    assert record_session(tmp_path, config) == [
        f"there is no copy of large.py in {tmp_path}: it is larger than 1024 KiB",
        f"there is no copy of locked.py in {tmp_path}: it cannot be read: Input/output error",
    ]
    large, locked, mine = sessions(tmp_path)[0]["modules"]
    assert large["sha256"] == hashlib.sha256(Path("large.py").read_bytes()).hexdigest()
    assert locked["sha256"] is None
    assert mine["copy"] == "modules/mine.py"
    assert [path.name for path in Path("modules").iterdir()] == ["mine.py"]
    Path("large.py").write_text("", encoding="utf-8")
    assert changed_modules(tmp_path, config) == [
        f"large.py has changed since {tmp_path} was trained: its digest then is in provenance.json there"
    ]


def test_a_module_without_source_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "typed_in", ModuleType("typed_in"))
    said = f"there is no copy of typed_in in {tmp_path}: it has no Python source"
    assert record_session(tmp_path, SMALL.changed(network="typed_in:Net")) == [said]


def test_a_script_that_is_run_is_copied_alone(monkeypatch):
    Path("my-script.py").write_text("import helper\n" + META, encoding="utf-8")
    script = ModuleType("__main__")
    script.__file__ = str(Path("my-script.py").absolute())
    monkeypatch.setitem(sys.modules, "__main__", script)
    assert names_of(SMALL.changed(meta="__main__:First")) == ["my-script.py"]


def test_a_link_to_a_module_is_copied_by_its_own_name():
    Path("elsewhere").mkdir()
    Path("elsewhere/real.py").write_text(META, encoding="utf-8")
    Path("mine.py").symlink_to("elsewhere/real.py")
    assert names_of(load("mine", {"other.py": ""})) == ["mine.py"]


def test_imports_from_beyond_the_top_package_are_passed_over():
    source = "try:\n    from .. import common\nexcept ImportError:\n    common = None\nfrom . import near\n" + META
    assert names_of(load("lab.metas", {"lab/__init__.py": "", "lab/metas.py": source, "lab/near.py": ""})) == [
        "lab/__init__.py",
        "lab/metas.py",
        "lab/near.py",
    ]


def test_modules_that_a_finder_of_pythons_knows_are_found(tmp_path, monkeypatch):
    """As those that ``pip install -e`` makes."""
    (tmp_path / "elsewhere" / "editable_lab").mkdir(parents=True)
    (tmp_path / "elsewhere" / "editable_lab" / "__init__.py").write_text("")
    (tmp_path / "elsewhere" / "editable_lab" / "metas.py").write_text(META)

    class Finder:
        @staticmethod
        def find_spec(name, path=None, target=None):
            if name == "editable_lab":
                return spec_from_file_location(name, tmp_path / "elsewhere" / "editable_lab" / "__init__.py")
            return None

    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, Finder])
    config = SMALL.changed(meta="editable_lab.metas:First")
    assert "editable_lab" not in sys.modules
    assert names_of(config) == ["editable_lab/__init__.py", "editable_lab/metas.py"]
    assert own_code_digest(config)
    assert own_code_digest(SMALL.changed(meta="editable_lab.nowhere:First")) == ""


def test_very_many_modules_are_not_all_copied():
    many = {f"m{n}.py": "" for n in range(MAX_FILES + 10)}
    config = load("mine", {"mine.py": "".join(f"import m{n}\n" for n in range(MAX_FILES + 10)) + META, **many})
    files = find_module_files(config)
    assert len(files) == MAX_FILES + 1
    assert files[0].problem == f"these and others are more than {MAX_FILES} files"


def test_a_module_that_changed_is_told_and_copied_beside_the_old(tmp_path):
    config = load("mine", {"mine.py": "import helper\n" + META, "helper.py": "X = 1\n"})
    assert record_session(tmp_path, config) == []
    assert changed_modules(tmp_path, config) == []
    Path("helper.py").write_text("X = 2\n", encoding="utf-8")
    Path("fresh.py").write_text("", encoding="utf-8")
    Path("mine.py").write_text("import fresh, helper\n" + META, encoding="utf-8")
    lines = [
        f"fresh.py is used now, and was not when {tmp_path} was trained",
        f"helper.py has changed since {tmp_path} was trained: what it was is modules/helper.py there",
        f"mine.py has changed since {tmp_path} was trained: what it was is modules/mine.py there",
    ]
    assert changed_modules(tmp_path, config) == lines
    assert record_session(tmp_path, config) == lines
    assert record_session(tmp_path, config) == []  # now they are known
    assert Path("modules/helper.py").read_text(encoding="utf-8") == "X = 1\n"
    assert Path("modules/session-2/helper.py").read_text(encoding="utf-8") == "X = 2\n"
    assert [one["copy"] for one in sessions(tmp_path)[2]["modules"]] == [
        f"modules/session-2/{name}.py" for name in ("fresh", "helper", "mine")
    ]
    assert changed_modules(tmp_path, SMALL) == []  # it plays with others


def test_evaluating_and_resuming_say_what_changed_and_go_on(monkeypatch, capsys):
    load("mine", {"mine.py": META})
    assert train([*FLAGS, "--meta", "mine:First", "--out", "run"]) == 0
    Path("run/modules/mine.py").write_text("raise SystemExit('a copy is never run')", encoding="utf-8")
    said = "warning: mine.py has changed since run was trained: what it was is modules/mine.py there\n"
    trusted = ["run", "--trust-run"]
    for arguments, warnings in ((trusted, ""), (["run", "--meta", "random"], "")):
        assert evaluated(capsys, arguments) == warnings
    Path("mine.py").write_text(META + "# now\n", encoding="utf-8")
    for arguments, warnings in ((trusted, said), (["run", "--meta", "random"], "")):
        assert evaluated(capsys, arguments) == warnings
    assert train(["--resume", "run", "--steps", "1024", "--meta", "mine:First"]) == 0
    assert capsys.readouterr().err == said
    assert evaluated(capsys, trusted) == ""


def evaluated(capsys, arguments: list[str]) -> str:
    capsys.readouterr()
    assert evaluate.main([*arguments, "--episodes", "2"]) == 0
    return re.sub(r"(?m)^(?!warning).*\n?", "", capsys.readouterr().err)  # the progress bar is there too


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"sessions": 1}', '{"sessions": [1]}', '{"sessions": [{}]}'])
def test_a_broken_provenance_is_one_line(text, tmp_path):
    Path("provenance.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"provenance\.json") as caught:
        record_session(tmp_path, SMALL)
    assert "\n" not in str(caught.value)
    assert Path("provenance.json").read_text(encoding="utf-8") == text


def test_a_run_from_before_or_without_it_is_no_error(tmp_path):
    assert changed_modules(tmp_path, load("mine", {"mine.py": META})) == []


def test_the_page_tells_of_every_file_of_a_run():
    load("mine", {"mine.py": META})
    GoalGraph((0, 1, 1), 3).to_toml("graph.toml")
    flags = [*FLAGS[FLAGS.index("--size") :], "--meta", "mine:First", "--graph", "graph.toml"]
    assert train([*flags, "--out", "run"]) == 0
    page = (Path(hierroom.__file__).parents[1] / "docs" / "runs.md").read_text()
    for path in Path("run").iterdir():
        told = "events.out.tfevents.*" if path.name.startswith("events") else f"{path.name}{'/' * path.is_dir()}"
        assert f"| `{told}` |" in page, told
    for entry in sessions(Path("run"))[0]:
        assert f"`{entry}`" in page, entry
