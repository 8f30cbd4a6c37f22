"""Runs and options that cannot be compared: left out of a folder with a note, or refused in one line."""

import re
import shutil
from pathlib import Path

import pytest
from evaluated_runs import line, make_run, row, rows

from hierroom.lab.compare.evaluated_run import find_runs


def test_folder_without_a_valid_run_raises_input_error(tmp_path, runs, compare, refused):
    refused("nowhere is neither a run folder", tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    refused("empty is neither a run folder", tmp_path / "empty")
    refused("give the folders of the runs")
    (runs / "random-0" / "config.json").write_text("{")
    assert f"- left out: cannot read {runs / 'random-0' / 'config.json'}: Expecting" in compare(runs)
    refused(r"cannot read .*random-0.config\.json: Expecting", runs / "random-0")


def test_run_without_evaluations_is_left_out(runs, compare, refused):
    without = (runs / "random-3").rename(runs / "\x1b[31m")
    (without / "evaluations.csv").unlink()
    printed = compare(runs, by="meta")
    assert f"left out, as it has no evaluations: {runs}/\\x1b[31m" in printed
    assert row("compare/summary.csv", group="random", graph="all")["n_runs"] == "3"
    refused("has no evaluations.csv; the run was made without", without)
    for path in runs.glob("*/evaluations.csv"):
        path.unlink()
    refused("no run in .* has evaluations", runs)


def test_run_evaluated_only_at_step_0_raises_input_error(runs, refused):
    alone = make_run(runs / "random-9", {"c": line(0.8)}, steps=(0,), meta="random", seed=9)
    refused("random-9 was evaluated up to 0 steps only", alone, *runs.glob("random-0"))
    assert find_runs([runs])[1] == [alone]  # among others in a folder it is left out


def test_copy_of_a_run_raises_input_error(runs, refused):
    shutil.copytree(runs / "random-0", runs / "random-copy")
    refused("random-0 and .*random-copy have the same seed, 0, and differ at most in steps", runs)


def test_two_graphs_with_one_name_raise_input_error(tmp_path, refused):
    for keys in ("[0, 1, 0]", "[0, 0, 0]"):
        (tmp_path / "mine.toml").write_text(f"key_rooms = {keys}\nexit_room = 3\n")
        make_run(tmp_path / "r" / keys, {"mine": line(0.5)}, graph=str(tmp_path / "mine.toml"))
    refused("two different goal graphs, layouts or tasks are called mine", tmp_path / "r")


def test_groups_without_common_graph_raise_input_error(tmp_path, refused):
    make_run(tmp_path / "r" / "a", {"a": line(0.5)}, meta="random")
    make_run(tmp_path / "r" / "c", {"c": line(0.5)})
    refused(r"no goal graph in common \(random: a; fixed-dfs: c\); add graph to --by", tmp_path / "r", by="meta")


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"by": "metta"}, "not 'metta'; is it meta\\?"),
        ({"by": "qq"}, "not 'qq'; there are .*gamma, .*meta, meta_features, .*, and the learner.s of meta_ppo too"),
        ({"by": "meta,"}, "not ''"),
        ({"resamples": 5}, "resamples must be at least 100, not 5"),
        ({"seed": -1}, "seed must be at least 0, not -1"),
    ],
)
def test_invalid_options_raise_input_error(tmp_path, refused, options, match):
    refused(match, make_run(tmp_path / "r", {"c": line(0.5)}), **options)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda text: text.replace("length_over_shortest", "detour"), "has no column length_over_shortest"),
        (lambda text: text + text.splitlines()[-1] + "\n", "the steps of graph c do not increase"),
        (lambda text: text.replace(",0.2,", ",7,"), "line 22: success_rate is a number from 0 to 1, not '7'"),
        (lambda text: text.encode("utf-16").decode("latin-1"), "line 1 is no row of text"),
    ],
)
def test_broken_evaluations_are_left_out_with_their_line(tmp_path, compare, refused, change, match):
    for seed in range(2):
        path = make_run(tmp_path / "r" / str(seed), {"c": line(0.2)}, seed=seed) / "evaluations.csv"
    path.write_text(change(path.read_text()), encoding="latin-1", newline="")
    printed = compare(tmp_path / "r")
    assert re.search(f"left out: .*r/1/evaluations.csv is broken: .*{match}", printed)
    assert row("compare/summary.csv", graph="all")["n_runs"] == "1"
    refused(f"evaluations.csv is broken: .*{match}", tmp_path / "r" / "1")


def test_compare_refuses_a_foreign_output_folder(tmp_path, compare, refused):
    run = make_run(tmp_path / "r", {"c": line(0.5)})
    Path("mine").mkdir()
    Path("mine/curves.csv").write_text("precious", encoding="utf-8")
    refused("mine is neither an empty folder nor that of an earlier comparison", run, out="mine")
    Path("file").touch()
    refused("file is neither an empty folder", run, out="file")
    refused("cannot create the folder file.below", run, by="meta", out="file/below")
    assert Path("mine/curves.csv").read_text(encoding="utf-8") == "precious"
    refused("nowhere is neither", "nowhere", out="unused")
    assert not Path("unused").exists()
    compare(run, by="meta", out="again")
    compare(run, by="method", out="again")  # its own is replaced
    assert "method" in rows("again/summary.csv")[0]
