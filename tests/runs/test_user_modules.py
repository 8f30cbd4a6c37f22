"""Copies of a user's modules in the folder of a run: the files that are copied, and warnings when they change."""

import hashlib
import importlib
import re
import sys
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest

import hierroom
from hierroom.commands import evaluate
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import changed_modules, read_sessions, record_session
from hierroom.runs.folder.user_code import MAX_BYTES, MAX_FILES, find_module_files, user_code_digest
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512).changed(minibatches=2)
FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8", "--minibatches", "2", "--steps", "512"]
FLAGS += ["--evaluations", "2", "--evaluation-episodes", "8", "--film", "False"]
META = "def first(level):\n    return level.legal_goals[0]\n"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """An empty folder; its modules are forgotten afterwards."""
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
    return SMALL.changed(meta=f"{module}:first")


def names_of(config: TrainConfig) -> list[str]:
    return [file.name for file in find_module_files(config)]


def test_imports_from_the_modules_folder_are_copied(tmp_path):
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


def test_modules_of_a_package_are_found():
    beyond = "try:\n    from .... import common\nexcept ImportError:\n    common = None\n"
    sources = {
        "lab/__init__.py": "",
        "lab/metas/__init__.py": "from . import own",
        "lab/metas/own.py": beyond + "from ..rules import X\n" + META,
        "lab/rules.py": "X = 1\n",
    }
    config = load("lab.metas.own", sources)
    assert names_of(config) == sorted(sources)
    assert names_of(config.changed(meta="lab.metas:own")) == sorted(sources)
    assert names_of(config.changed(meta=None, reward="lab.rules:X")) == ["lab/__init__.py", "lab/rules.py"]


def test_installed_package_is_copied_without_its_imports(monkeypatch, tmp_path):
    site = tmp_path / "site-packages"
    site.mkdir()
    monkeypatch.chdir(site)
    monkeypatch.setattr(sys, "path", [str(site), *sys.path])
    load("plugin.meta", {"plugin/__init__.py": "", "plugin/meta.py": "import other\n" + META, "other.py": ""})
    assert names_of(SMALL.changed(meta="plugin.meta:first")) == ["plugin/__init__.py", "plugin/meta.py"]


def test_code_of_hierroom_is_not_copied(tmp_path):
    for changes in ({}, {"meta": "learned"}, {"meta": "hierroom.meta:FixedDFS"}, {"graph": "hitting_time:8..13"}):
        assert find_module_files(SMALL.changed(**changes)) == []
    Path("workshop.py").write_text("", encoding="utf-8")  # no module of the built-in workshops
    assert find_module_files(TrainConfig(EnvConfig(task="workshop:4"))) == []
    assert record_session(tmp_path, SMALL) == []
    assert not Path("modules").exists()


def test_uncopied_modules_are_reported(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "typed_in", ModuleType("typed_in"))
    config = load("mine", {"mine.py": "import large, locked\n" + META, "large.py": "", "locked.py": ""})
    config = config.changed(network="typed_in:Net")
    Path("large.py").write_bytes(b"#" * (MAX_BYTES + 1))
    Path("locked.py").unlink()
    Path("locked.py").symlink_to("/proc/self/mem")  # there, and cannot be read even by root
    assert record_session(tmp_path, config) == [
        f"there is no copy of large.py in {tmp_path}: it is larger than 1024 KiB",
        f"there is no copy of locked.py in {tmp_path}: it cannot be read: Input/output error",
        f"there is no copy of typed_in in {tmp_path}: it has no Python source",
    ]
    large, locked, mine, _ = read_sessions(tmp_path)[0]["modules"]
    assert large["sha256"] == hashlib.sha256(Path("large.py").read_bytes()).hexdigest()
    assert locked["sha256"] is None
    assert mine["copy"] == "modules/mine.py"
    assert [path.name for path in Path("modules").iterdir()] == ["mine.py"]
    Path("large.py").write_text("", encoding="utf-8")
    assert changed_modules(tmp_path, config) == [
        f"large.py has changed since {tmp_path} was trained: its digest then is in provenance.json there"
    ]


def test_modules_of_import_finders_are_found(tmp_path, monkeypatch):
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
    config = SMALL.changed(meta="editable_lab.metas:first")
    assert "editable_lab" not in sys.modules
    assert names_of(config) == ["editable_lab/__init__.py", "editable_lab/metas.py"]
    assert user_code_digest(config)
    assert user_code_digest(SMALL.changed(meta="editable_lab.nowhere:first")) == ""


def test_number_of_copied_modules_is_limited():
    many = {f"m{n}.py": "" for n in range(MAX_FILES + 10)}
    config = load("mine", {"mine.py": "".join(f"import m{n}\n" for n in range(MAX_FILES + 10)) + META, **many})
    files = find_module_files(config)
    assert len(files) == MAX_FILES + 1
    assert files[0].problem == f"these and others are more than {MAX_FILES} files"


def test_changed_module_is_reported_and_copied_again(tmp_path):
    config = load("mine", {"mine.py": "import helper\n" + META, "helper.py": "X = 1\n"})
    assert changed_modules(tmp_path, config) == []  # nothing was trained there yet
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
    assert [one["copy"] for one in read_sessions(tmp_path)[2]["modules"]] == [
        f"modules/session-2/{name}.py" for name in ("fresh", "helper", "mine")
    ]
    assert changed_modules(tmp_path, SMALL) == []  # it plays with others


def test_evaluate_and_resume_warn_of_changed_modules(monkeypatch, capsys):
    load("mine", {"mine.py": META})
    assert train([*FLAGS, "--meta", "mine:first", "--out", "run"]) == 0
    Path("run/modules/mine.py").write_text("raise SystemExit('a copy is never run')", encoding="utf-8")
    said = "warning: mine.py has changed since run was trained: what it was is modules/mine.py there\n"
    trusted = ["run", "--trust-run"]
    for arguments, warnings in ((trusted, ""), (["run", "--meta", "random"], "")):
        assert evaluation_warnings(capsys, arguments) == warnings
    Path("mine.py").write_text(META + "# now\n", encoding="utf-8")
    for arguments, warnings in ((trusted, said), (["run", "--meta", "random"], "")):
        assert evaluation_warnings(capsys, arguments) == warnings
    assert train(["--resume", "run", "--steps", "1024", "--meta", "mine:first"]) == 0
    assert capsys.readouterr().err == said
    assert evaluation_warnings(capsys, trusted) == ""


TASK = """import hierroom
goals = {"half": lambda env, info: env.unwrapped.s >= 8, "gift": lambda env, info: env.unwrapped.s == 15}
task = hierroom.Task("FrozenLake-v1", goals, target="gift", max_steps=20)
"""


@pytest.mark.parametrize(
    ("old", "new", "resuming", "evaluating"),
    [
        ("goals, target", "dict(reversed(goals.items())), target", "goals must be 'gift, half', not 'half", True),
        ("max_steps=20", "max_steps=9", "world.taken must be at most 9, not ", False),
    ],
)
def test_task_that_changed_its_meaning_is_refused_with_its_change(old, new, resuming, evaluating):
    load("tasks", {"tasks.py": TASK})
    assert train([*FLAGS[6:], "--task", "tasks:task", "--out", "run"]) == 0
    del sys.modules["tasks"]
    load("tasks", {"tasks.py": TASK.replace(old, new)})
    change = "tasks.py has changed since run was trained: what it was is modules/tasks.py there"
    with pytest.raises(InputError) as refused:
        train(["--resume", "run", "--trust-run", "--steps", "1024"])
    assert resuming in str(refused.value)
    assert str(refused.value).endswith(f"; {change}")
    if evaluating:
        with pytest.raises(InputError, match=rf"with goals half, gift, not gift, half; {change}"):
            hierroom.load("run", trust=True)
    else:
        assert hierroom.load("run", trust=True).steps == 512


def evaluation_warnings(capsys, arguments: list[str]) -> str:
    capsys.readouterr()
    assert evaluate.main([*arguments, "--episodes", "2"]) == 0
    return re.sub(r"(?m)^(?!warning).*\n?", "", capsys.readouterr().err)  # the progress bar is there too
