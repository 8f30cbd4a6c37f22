"""The commands of the docs end well: run in a folder that holds what they name; training and windows are left out."""

import shlex
import shutil
from pathlib import Path

import pytest
from doc_pages import ROOT, commands
from fuzz.commands import SMALL_OPTIONS, end_of, train_quietly

HEAD = ("python", "-m")
LEFT_OUT = ("hierroom.lab.paper",)  # test_paper.py runs them from nothing, small; table2 trains nothing
COMMANDS = sorted(
    {
        command
        for found in commands().values()
        for command in found
        if len(words := shlex.split(command)) > 3
        and tuple(words[:2]) == HEAD
        and words[2].startswith("hierroom.")
        and (words[2] not in LEFT_OUT or words[3] == "table2")
    }
)
SET = "runs/hippo-fixed-dfs-rooms-4-no-g-seed0"
NAMES = {"RUNS": "runs", "[RUN": "runs/hippo-fixed-dfs-c-seed0", "...]": None}
"""What stands for names of one's own, and what it is here."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with the runs that the pages name, hardly trained, and the files of one's own."""
    folder = tmp_path_factory.mktemp("docs")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        for name, options in (
            ("runs/hippo-fixed-dfs-c-seed0", ["--graph", "c"]),
            ("runs/hippo-random-c-seed0", ["--graph", "c", "--meta", "random"]),
            (SET, ["--graph", "rooms:4", "--exclude", "g"]),
        ):
            assert train_quietly([*SMALL_OPTIONS[2:], *options, "--size", "15", "--out", name]) == 0
    for name in ("RUN", "first"):
        shutil.copytree(folder / "runs" / "hippo-fixed-dfs-c-seed0", folder / name)
    (folder / "own.toml").write_text("seed = 1\n")
    for name in ("sweeps", "graphs"):
        shutil.copytree(ROOT / "benchmarks" / name, folder / "benchmarks" / name)
    return folder


def test_the_pages_have_commands():
    assert {shlex.split(command)[2].partition(".")[2] for command in COMMANDS} >= {
        *("train", "sweep", "play", "watch", "evaluate", "compare", "report", "complexity", "paper"),
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_it_ends_well(command, folder, tmp_path, monkeypatch):
    _, _, module, *words = shlex.split(command)
    place = tmp_path / "folder"
    shutil.copytree(folder, place)
    monkeypatch.chdir(place)
    monkeypatch.syspath_prepend(ROOT)  # where the plans name benchmarks/variants.py
    monkeypatch.syspath_prepend(ROOT / "examples")
    if SET not in words:  # which has no goal graph in common with the others
        shutil.rmtree(SET)
    words = [named for word in words if (named := NAMES.get(word, word)) is not None]
    words = [one for word in words for one in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]
    if "--out" in words and module != "hierroom.lab.compare":  # which the page has made before, or will
        shutil.rmtree(words[words.index("--out") + 1], ignore_errors=True)
    if module == "hierroom.commands.watch":
        words.append("--text")
    code, told = end_of(module.partition(".")[2], words)
    assert code == 0, told
