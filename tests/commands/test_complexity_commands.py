"""The command that prints complexity."""

import csv
import io
import json
import re
import sys

import pytest
from children import run_child

from hierroom.commands.complexity import main
from hierroom.complexity import analyze
from hierroom.support.cli import run
from hierroom.support.errors import InputError


def command(*arguments):
    return run_child([sys.executable, "-m", "hierroom", "complexity", *arguments])


@pytest.fixture
def printed(capsys):
    def show_and_read(words):
        assert main(words.split()) == 0
        return capsys.readouterr().out

    return show_and_read


def test_complexity_prints_graphs_as_text_json_and_csv(printed):
    assert "hitting time    15.07" in printed("--graph c")
    assert json.loads(printed("--graph c --json"))["nodes"] == 9
    for words, graphs in (("--all", "abcdefg"), ("--exclude g b", "acdef"), ("--graph hitting_time:8..9", "a")):
        assert [report["graph"] for report in json.loads(printed(f"{words} --json"))] == list(graphs)
    rows = list(csv.DictReader(io.StringIO(printed("--graph rooms:4 --drop --csv"))))
    assert len(rows) == 9
    assert {row["drop_key"] for row in rows} == {"True"}


def test_graph_option_takes_toml_file_and_interval(tmp_path, printed):
    path = tmp_path / "own.toml"
    path.write_text("key_rooms = [0, 1]\nexit_room = 2\n")
    assert printed(f"--graph {path}") == printed("--graph c").replace("goal graph c", "goal graph own")
    assert "\n g " in printed("--graph hitting_time:27.4..27.6")


@pytest.mark.slow
def test_several_graphs_are_all_listed(tmp_path):
    (tmp_path / "[red]own.toml").write_text("key_rooms = [0, 1, 1]\nexit_room = 3\n")
    done = command("--graph", str(tmp_path / "[red]own.toml"), "c", "f", "c")
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if line.count(".") == 3]
    assert [row[0] for row in rows] == ["[red]own", "c", "f"]
    done = command("--graph", "expected_steps:90..150", "rooms:4", "--exclude", "f", "g", "--json")
    names = [report["graph"] for report in json.loads(done.stdout)]
    assert {"d", "e"} <= set(names)
    assert not {"f", "g"} & set(names)


def test_json_output_names_every_number(printed):
    """There is no array of bare numbers: a reader would have to know their order."""

    def arrays_of_numbers(value):
        entries = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        within = [found for entry in entries for found in arrays_of_numbers(entry)]
        is_array = isinstance(value, list) and any(not isinstance(entry, (dict, str)) for entry in value)
        return [value, *within] if is_array else within

    report = json.loads(printed("--graph d --json"))
    assert report["key_rooms"] == {"key 1": 0, "key 2": 0, "key 3": 1}
    assert arrays_of_numbers(report) == []
    assert arrays_of_numbers(json.loads(printed("--graph rooms:3 --json"))) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--graph", "rooms:40"], "rooms:N takes a number of rooms from 2 to 8, not 40"),
        (["--draw", "x.png"], "--draw draws one graph"),
        (["--graph", "a", "--draw", "x.gif"], "drawings are written as .png, .pdf, .svg, not as x.gif"),
        (["--walk=-0.5", "1", "0.5"], "the probability stay of a walk must be from 0 to 1, not -0.5"),
    ],
)
def test_invalid_input_raises_input_error(arguments, message):
    with pytest.raises(InputError, match=re.escape(message)):
        main(arguments)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--graph a --all", "--graph and --all are not allowed together"),
        ("--json --csv", "--json and --csv are not allowed together"),
        ("--graph a --seed 3", "Unrecognized options: --seed"),
        ("--rules x.toml --drop", "Unrecognized options: --drop"),
    ],
)
def test_options_of_another_kind_of_input_are_refused(words, message, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words.split())
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_each_kind_of_input_has_its_help(capsys):
    for words, option in (("-h", "--exclude"), ("--rules --help", "--task")):
        with pytest.raises(SystemExit) as ended:
            main(words.split())
        assert ended.value.code == 0
        assert option in capsys.readouterr().out


def test_error_is_one_line_with_exit_code_2(capsys):
    with pytest.raises(SystemExit) as ended:
        run(lambda: main(["--graph", "rooms:40"]))
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("error: rooms:N takes a number of rooms from 2 to 8, not 40")


def test_complexity_notes_equal_graphs(tmp_path, printed, capsys):
    (tmp_path / "mine.toml").write_text('name = "mine"\nkey_rooms = [2, 0]\nexit_room = 1\n')
    main(["--graph", "c", str(tmp_path / "mine.toml")])
    assert capsys.readouterr().err.startswith("warning: goal graphs c and mine are the same")


def test_walk_option_changes_the_list_and_csv_is_precise(capsys):
    main(["--graph", "a", "c", "--walk", "0.5", "0.4", "0.1"])
    assert "c 4 1 9 14 10.61 60.8 53.2" in " ".join(capsys.readouterr().out.split())
    main(["--graph", "a", "c", "--csv"])
    assert capsys.readouterr().out.splitlines()[1].split(",")[-2] == repr(analyze("a").expected_steps)
    with pytest.raises(InputError, match=r"must sum to 1, not 1\.3"):
        main(["--walk", "0.5", "0.4", "0.4"])
