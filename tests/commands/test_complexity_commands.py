"""The command that prints complexity."""

import csv
import io
import json
import re
import sys

import pytest
from children import run_child

from hierroom.commands.complexity import ComplexityArguments, main, show
from hierroom.support.errors import InputError


def command(*arguments):
    return run_child([sys.executable, "-m", "hierroom", "complexity", *arguments])


@pytest.fixture
def printed(capsys):
    def show_and_read(**options):
        show(ComplexityArguments(**options))
        return capsys.readouterr().out

    return show_and_read


def test_complexity_prints_graphs_as_text_json_and_csv(printed):
    assert "hitting time    15.07" in command("--graph", "c").stdout
    assert json.loads(printed(graph="c", json=True))["nodes"] == 9
    listed = ({"all": True}, "abcdefg"), ({"exclude": ("g", "b")}, "acdef"), ({"graph": "hitting_time:8..9"}, "a")
    for options, graphs in listed:
        assert [report["graph"] for report in json.loads(printed(**options, json=True))] == list(graphs)
    rows = list(csv.DictReader(io.StringIO(printed(graph="rooms:4", drop=True, sort="hitting_time", csv=True))))
    values = [float(row["hitting_time"]) for row in rows]
    assert len(rows) == 9
    assert values == sorted(values)
    assert {row["drop_key"] for row in rows} == {"True"}


def test_graph_option_takes_toml_file_and_interval(tmp_path, printed):
    path = tmp_path / "own.toml"
    path.write_text("key_rooms = [0, 1]\nexit_room = 2\n")
    assert printed(graph=str(path)) == printed(graph="c").replace("goal graph c", "goal graph own")
    assert "\n g " in printed(graph="hitting_time:27.4..27.6")


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

    report = json.loads(printed(graph="d", json=True))
    assert report["key_rooms"] == {"key 1": 0, "key 2": 0, "key 3": 1}
    assert arrays_of_numbers(report) == []
    assert arrays_of_numbers(json.loads(printed(graph="rooms:3", json=True))) == []
    assert arrays_of_numbers(json.loads(printed(from_play="oracle", graph="a", episodes=3, json=True))) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--graph", "a", "--all"], "by only one of --graph, --layout and --all"),
        (["--graph", "rooms:40"], "rooms:N takes a number of rooms from 2 to 8, not 40"),
        (["--json", "--csv"], "choose one of --json, --csv, --latex, --markdown, not 2"),
        (["--draw", "x.png"], "--draw draws one graph"),
        (["--graph", "a", "--draw", "x.gif"], "drawings are written as .png, .pdf, .svg, not as x.gif"),
        (
            ["--graph", "a", "--seed", "3"],
            "--episodes, --seed, --size, --max-steps and --trust-run go with --from-play",
        ),
        (["--walk=-0.5", "1", "0.5"], "the probability stay of a walk must be from 0 to 1, not -0.5"),
    ],
)
def test_invalid_input_raises_input_error(arguments, message):
    with pytest.raises(InputError, match=re.escape(message)):
        main(arguments)


def test_error_is_one_line_with_exit_code_2():
    done = command("--graph", "rooms:40")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: rooms:N takes a number of rooms from 2 to 8, not 40")
    assert done.stderr.count("\n") == 1


def test_complexity_notes_equal_graphs(tmp_path, printed, capsys):
    (tmp_path / "mine.toml").write_text('name = "mine"\nkey_rooms = [2, 0]\nexit_room = 1\n')
    show(ComplexityArguments(graph=("c", str(tmp_path / "mine.toml"))))
    assert capsys.readouterr().err.startswith("warning: goal graphs c and mine are the same")
