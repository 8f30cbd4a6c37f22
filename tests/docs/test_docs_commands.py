"""The commands of the docs succeed in a folder with the files that they name, without training and windows."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
from doc_pages import PAGES, ROOT, commands
from fuzz.commands import SMALL_OPTIONS, end_of, train_quietly

from benchmarks.arena.families import FAMILIES
from hierroom.__main__ import COMMANDS as NAMES_OF_COMMANDS

HEAD = ["python", "-m", "hierroom"]
COMMANDS = sorted(
    {
        command
        for found in commands().values()
        for command in found
        if len(words := shlex.split(command)) > 4 and words[:3] == HEAD
    }
)
SET = "runs/hippo-fixed-dfs-rooms-4-no-g-seed0"
OF_TASK = "runs/hippo-fixed-dfs-my_tasks-taxi-seed0-steps300k"
NAMES = {"RUNS": "runs", "[RUN": "runs/hippo-fixed-dfs-c-seed0", "...]": None}
NAMES |= {"runs/ppo-my_tasks-taxi-seed0-steps300k": None}
"""Stand-ins for user-chosen names, and their values here."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        patched.syspath_prepend(ROOT / "examples")
        assert train_quietly(["--task", "my_tasks:taxi", *SMALL_OPTIONS[4:], "--out", OF_TASK]) == 0
        for name, options in (
            ("runs/hippo-fixed-dfs-c-seed0", ["--graph", "c"]),
            ("runs/hippo-random-c-seed0", ["--graph", "c", "--meta", "random"]),
            (SET, ["--graph", "rooms:4", "--exclude", "g"]),
        ):
            assert train_quietly([*SMALL_OPTIONS[2:], *options, "--size", "15", "--out", name]) == 0
    for name in ("RUN", "first"):
        shutil.copytree(folder / "runs" / "hippo-fixed-dfs-c-seed0", folder / name)
    (folder / "own.toml").write_text("seed = 1\n")
    (folder / "maze.txt").write_text(re.search(r'maze = """(.*?)"""', PAGES["environments.md"], re.DOTALL)[1])
    for name in ("sweeps", "graphs"):
        shutil.copytree(ROOT / "benchmarks" / name, folder / "benchmarks" / name)
    return folder


def test_docs_show_every_command():
    assert {shlex.split(command)[3] for command in COMMANDS} == {*NAMES_OF_COMMANDS} - {"compile"}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_command_of_the_docs_succeeds(command, folder, tmp_path, monkeypatch):
    for family in FAMILIES.values():
        if f"benchmarks.arena.{family.name}:" in command and not family.is_installed:
            pytest.skip(f"{family.name} is not installed:  pip install {family.install}")
    name, *words = shlex.split(command)[3:]
    place = tmp_path / "folder"
    shutil.copytree(folder, place)
    monkeypatch.chdir(place)
    monkeypatch.syspath_prepend(ROOT)  # where the plans name benchmarks/variants.py
    monkeypatch.syspath_prepend(ROOT / "examples")
    for other in {SET, OF_TASK} - {*words}:  # which have no goal graph in common with the others
        shutil.rmtree(other)
    words = [named for word in words if (named := NAMES.get(word, word)) is not None]
    words = [one for word in words for one in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]
    if "--out" in words and name != "compare":  # which the page has made before, or will
        shutil.rmtree(words[words.index("--out") + 1], ignore_errors=True)
    if name == "watch" and "--out" not in words:
        words.append("--text")
    code, output = end_of(name, words)
    assert code == 0, output
