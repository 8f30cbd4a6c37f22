"""The command line of a new user: commands are listed, explained fast, and refuse wrong input."""

import re
from dataclasses import dataclass
from functools import cache

import pytest
from children import run_child, run_python

import hierroom
from hierroom.__main__ import COMMANDS, main
from hierroom.agents.config import METHODS, MethodName
from hierroom.runs.config.config import PresetName
from hierroom.runs.config.presets import PRESETS
from hierroom.support.cli import LISTS, read_arguments
from hierroom.support.errors import InputError
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.env_config import GoalMaskName, RewardName
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS


@cache
def help_of(*words):
    done = run_python("-X", "importtime", "-m", "hierroom", *words, "--help")
    assert done.returncode == 0, done.stderr
    return done.stdout, {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}


def test_the_commands_are_listed(capsys):
    assert main([]) == main(["--help"]) == 0
    said = capsys.readouterr().out
    for name in COMMANDS:
        assert said.count(f"python -m hierroom {name} ") == 2


def test_version_option_prints_the_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == hierroom.__version__


def test_unknown_command_error_suggests_similar_names():
    done = run_python("-m", "hierroom", "trian", "--graph", "a")
    assert done.returncode == 2
    assert done.stderr == "error: there is no command 'trian'; did you mean train? python -m hierroom lists all\n"
    with pytest.raises(InputError, match=r"there is no command '--foo'; python -m hierroom lists all"):
        main(["--foo"])


def test_hierroom_train_module_is_the_train_command():
    assert run_python("-m", "hierroom.train", "--help").stdout.startswith("usage: python -m hierroom train [-h]")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_printed_without_loading_torch(name):
    """Imports decide how soon the help appears: without torch well under a second."""
    text, imported = help_of(name)
    assert text.startswith(f"usage: python -m hierroom {name} [-h]")
    assert "numpy" in imported
    assert "torch" not in imported


@pytest.mark.parametrize(
    ("choices", "table"),
    [(MethodName, METHODS), (RewardName, REWARDS), (GoalMaskName, GOAL_MASKS), (PresetName, PRESETS)],
    ids=["method", "reward", "goal mask", "preset"],
)
def test_command_line_has_every_choice(choices, table):
    assert set(choices.__args__) == set(table)


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


def numbers_of(*words):
    return read_arguments(Numbers, "count", words)


def test_whole_number_options_take_exponents():
    assert numbers_of("--steps", "1e6", "--rooms", "2.5e1", "--seeds", "1e1", "1_000") == Numbers(10**6, 25, (10, 1000))
    assert numbers_of("--steps=-3", "--rooms", "None") == Numbers(-3, None)
    assert numbers_of("--steps", str(2**70 + 1)).steps == 2**70 + 1
    assert isinstance(numbers_of("--steps", "1e6").steps, int)


@pytest.mark.parametrize("text", ["1e-1", "2.5", "inf", "nan", "1e400", "many", ""])
@pytest.mark.parametrize("option", ["--steps", "--rooms"])
def test_whole_number_options_refuse_other_texts(option, text, capsys):
    with pytest.raises(SystemExit) as ended:
        numbers_of(option, text)
    assert ended.value.code == 2
    assert f"it must be a whole number, not {text!r}" in capsys.readouterr().err


def test_list_options_refuse_missing_and_repeated_values():
    """Tyro reads a list without values as an empty one, and keeps the last of two."""
    for words in (["--graph"], ["--graph", "--seed", "1"], ["--meta-features"]):
        with pytest.raises(InputError, match=f"{words[0]} is given without a value; give at least one"):
            main(["train", *words])
    for words in (["--exclude", "a", "--exclude", "b"], ["--exclude=a", "--seed", "1", "--exclude", "b"]):
        with pytest.raises(InputError, match="--exclude is given twice; give it once, with all its values"):
            main(["evaluate", "c", *words])
    with pytest.raises(InputError, match="--meta-features is given twice"):
        main(["train", "--meta_features", "view", "--meta-features", "goal"])


def test_lists_has_every_list_option(capsys):
    for words in (*([name] for name in COMMANDS), ["complexity", "--rules"]):
        with pytest.raises(SystemExit):
            main([*words, "--help"])
    found = {*re.findall(r"(--[\w-]+) (?:[A-Z]+ )?\[", capsys.readouterr().out)}
    assert found == set(LISTS)


def test_bash_completes_commands_options_and_choices(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["train", "--tyro-print-completion", "bash"])
    (tmp_path / "completion.bash").write_text(capsys.readouterr().out)
    lines = ["train --warm-s", "train --method ppo-b", "ev", "evaluate --goal-m"]
    asked = "\n".join(f"COMP_WORDS=(hierroom {line}); complete_it" for line in lines)
    (tmp_path / "ask.bash").write_text(
        f"source {tmp_path}/completion.bash\n"
        "complete_it() { COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=(); _tyro_hierroom; echo ${COMPREPLY[@]}; }\n"
        f"{asked}\n"
    )
    done = run_child(["bash", tmp_path / "ask.bash"])
    completed = ["--warm-start", "ppo-bonus", "evaluate", "--goal-mask"]
    assert done.stdout.splitlines() == completed, done.stderr
