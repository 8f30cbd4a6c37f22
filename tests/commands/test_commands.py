"""The commands as a stranger meets them: they are listed, and explain themselves at once, choice by choice."""

import re
import subprocess
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
import tyro
from escape_room import FEATURES

import hierroom
from hierroom.agents.config import METHODS, FeatureName, MethodName
from hierroom.runs.config.config import PresetName
from hierroom.runs.config.presets import PRESETS
from hierroom.support.cli import COMMANDS, one_line_usage
from hierroom.support.errors import InputError
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.env_config import GoalMaskName, RewardName
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS


def run(*arguments, env=None):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=60, env=env)


def help_of(module):
    done = run("-m", module, "--help")
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_package_lists_its_commands():
    done = run("-m", "hierroom")
    assert done.returncode == 0
    for name in COMMANDS:
        assert f"python -m hierroom.{name}" in done.stdout


def test_a_command_given_as_a_word_is_named_as_it_is_called():
    done = run("-m", "hierroom", "train", "--graph", "a")
    assert done.returncode == 2
    assert done.stderr == "error: train is a command of its own: python -m hierroom.train --graph a\n"


def test_the_version():
    assert run("-m", "hierroom", "--version").stdout.strip() == hierroom.__version__


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_there_without_torch(name):
    """What is imported decides how soon it is there: without torch well under a second."""
    done = run("-X", "importtime", "-m", f"hierroom.{name}", "--help")
    assert "usage:" in done.stdout
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "numpy" in imported
    assert "torch" not in imported


@pytest.mark.parametrize(
    ("choices", "table"),
    [
        (MethodName, METHODS),
        (FeatureName, FEATURES),
        (RewardName, REWARDS),
        (GoalMaskName, GOAL_MASKS),
        (PresetName, PRESETS),
    ],
    ids=["method", "feature", "reward", "goal mask", "preset"],
)
def test_the_choices_on_the_command_line_are_all_there_are(choices, table):
    assert set(choices.__args__) == set(table)


def test_choices_are_shown_and_options_grouped():
    text = help_of("hierroom.train")
    for group in ("options", "env options", "agents options", "ppo options", "meta-ppo options"):
        assert f"─ {group} ─" in text
    assert "--method {ppo,ppo-bonus," in text
    assert "--goal-mask {reachable,existing,seen,none}" in text
    assert "--reward REWARD" in text
    assert "--preset {default,long,large,learned,paper,algorithm1}" in text


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "paper"])
def test_each_help_text_is_one_paragraph(name):
    """No line is broken before it is full: the next line's first word would not have fitted."""
    lines = [re.sub(r"^│|│$", "", line) for line in help_of(f"hierroom.{name}").splitlines() if line.startswith("│")]
    for line, following in pairwise(lines):
        indent = len(following) - len(following.lstrip())
        is_text = indent >= 7 and following.strip() and not following.strip().startswith(("-", "{"))
        if is_text and len(line) - len(line.lstrip()) == indent and line.strip():
            first = following.split()[0]
            assert len(line.rstrip()) + 1 + len(first) >= len(line) - 2, (line, following)


def test_a_wrong_choice_is_refused_with_the_right_ones():
    done = run("-m", "hierroom.train", "--method", "pop")
    assert done.returncode == 2
    assert "'pop'" in done.stderr
    assert "hippo" in done.stderr
    assert "Traceback" not in done.stderr


@dataclass(frozen=True)
class Numbers:
    """Options of whole numbers.

    Args:
        steps: some.
        rooms: some or all.
        seeds: several.
    """

    steps: int = 1
    rooms: int | None = None
    seeds: tuple[int, ...] = ()


def numbers_of(*line):
    with one_line_usage(line):
        return tyro.cli(Numbers, args=line)


def test_a_whole_number_may_have_an_exponent_as_in_a_file():
    assert numbers_of("--steps", "1e6", "--rooms", "2.5e1", "--seeds", "1e1", "1_000") == Numbers(10**6, 25, (10, 1000))
    assert numbers_of("--steps=-3", "--rooms", "None") == Numbers(-3, None)
    assert numbers_of("--steps", str(2**70 + 1)).steps == 2**70 + 1
    assert isinstance(numbers_of("--steps", "1e6").steps, int)


@pytest.mark.parametrize("text", ["1e-1", "2.5", "inf", "nan", "1e400", "many", ""])
def test_what_is_no_whole_number_is_refused_as_it_was_typed(text):
    with pytest.raises(InputError, match=f"--steps: it must be a whole number, not '{re.escape(text)}'"):
        numbers_of("--steps", text)
    with pytest.raises(InputError, match="--rooms: it must be a whole number or None, not "):
        numbers_of("--rooms", text)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_shell_completes_the_options_of_the_script(name):
    script = Path(sys.executable).with_name(f"hierroom-{name}")
    done = subprocess.run([script, "--tyro-print-completion", "bash"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert f"complete -F _tyro_hierroom_{name} " in done.stdout
    option = {
        "train": "--method",
        "evaluate": "--goal-mask",
        "sweep": "--shard",
        "watch": "--failures",
        "play": "--fog",
        "compare": "--metric",
        "report": "--replays",
        "complexity": "--graph",
        "paper": "table2",
        "compile": "--help",
    }[name]
    assert option in done.stdout
