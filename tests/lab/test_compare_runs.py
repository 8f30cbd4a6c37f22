"""Comparing runs as a user would: folders in, tables, CSV and a figure out, one clear line where it cannot be."""

import csv
import json
import re
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from evaluated_runs import line, make_run, rise
from pictures import has_colour, pixels

from hierroom.commands import compare as command
from hierroom.lab.compare import figure
from hierroom.lab.compare.evaluated_run import find_runs, read_run
from hierroom.lab.compare.style import COLOURS, DASHES, MAX_GROUPS, line_style
from hierroom.runs.folder.provenance import record_session
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.plots import step_unit
from hierroom.support.errors import InputError

ENDS = {"fixed-dfs": (0.7, 0.8, 0.9, 1.0), "random": (0.2, 0.4, 0.6, 0.8)}
"""Success rates after a million steps, by seed; on their way they rise in straight lines from 0."""


@pytest.fixture
def runs(tmp_path):
    for meta, ends in ENDS.items():
        for seed, end in enumerate(ends):
            make_run(tmp_path / "runs" / f"{meta}-{seed}", {"c": line(end)}, meta=meta, seed=seed)
    return tmp_path / "runs"


@pytest.fixture
def compare(tmp_path, monkeypatch, capsys):
    """Run the command in an empty folder; returns what it prints. The figure, which takes its time, is left out."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("COLUMNS", "120")

    def run(*arguments, draws=False, **options):
        options = {"out": "compare", **options}
        flags = [text for name, value in options.items() for text in (f"--{name}", str(value))]
        with monkeypatch.context() as patch:
            if not draws:
                patch.setattr(figure, "draw_comparison", lambda comparison, folder: [])
            assert command.main([*map(str, arguments), "--resamples", "200", *flags]) == 0
        return capsys.readouterr().out

    return run


def rows(path):
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def row(path, **wanted):
    (found,) = [one for one in rows(path) if all(one[name] == str(value) for name, value in wanted.items())]
    return found


def number(text):
    return float(text) if text else None


def test_the_numbers(runs, compare):
    printed = compare(runs, by="meta")
    random = row("compare/summary.csv", meta="random", graph="c")
    # 0.2, 0.4, 0.6 and 0.8: the middle two are 0.4 and 0.6; half of that lies under straight lines from 0
    expected = {"final_iqm": 0.5, "final_mean": 0.5, "auc_iqm": 0.25, "auc_mean": 0.25, "n_runs": 4, "n_seeds": 4}
    assert {name: float(random[name]) for name in expected} == pytest.approx(expected)
    assert 0.2 <= float(random["final_iqm_low"]) < 0.5 < float(random["final_iqm_high"]) <= 0.8
    # half of the success is reached by two of four, after 1M x 0.5 / 0.6 and / 0.8: not by the median run
    assert (random["steps_to_50"], random["reached_50"], random["reached_90"]) == ("", "0.5", "0.0")
    fixed = row("compare/summary.csv", meta="fixed-dfs", graph="c")
    assert float(fixed["final_iqm"]) == pytest.approx(0.85)
    assert float(fixed["steps_to_50"]) == pytest.approx(1e6 * (0.5 / 0.8 + 0.5 / 0.9) / 2)
    # of 16 pairs fixed-dfs loses two, 0.7 and 0.8 against 0.8, one of them a tie: 14.5
    for score in ("final", "auc"):
        pair = row("compare/improvement.csv", group="fixed-dfs", other="random", score=score)
        assert float(pair["probability"]) == pytest.approx(14.5 / 16)
        assert float(pair["probability_low"]) < 14.5 / 16 <= float(pair["probability_high"]) <= 1
    text = re.sub(r"\s+", " ", printed)
    assert re.search(r"random 4 50\.0% 25\.0% >1\.00M - - \[", text)
    assert re.search(r"fixed-dfs random 0\.91 \[0\.\d\d, \d\.\d\d\]", text)


def test_the_curves(runs, compare):
    compare(runs, by="meta")
    curve = [one for one in rows("compare/curves.csv") if (one["group"], one["graph"]) == ("random", "all")]
    assert len(curve) == 21
    for one in curve:
        middle = 0.5 * int(one["steps"]) / 1e6
        assert float(one["iqm"]) == pytest.approx(middle, abs=1e-6)
        assert float(one["low"]) <= middle + 1e-6
        assert float(one["high"]) >= middle - 1e-6
        assert one["n_runs"] == "4"
    assert [int(one["steps"]) for one in curve] == sorted({int(one["steps"]) for one in curve})


def test_less_is_better_for_lengths(runs, compare):
    printed = compare(runs, by="meta", metric="length")
    fixed = row("compare/summary.csv", meta="fixed-dfs", graph="all")
    assert float(fixed["final_iqm"]) == pytest.approx(1000 - 950 * 0.85)
    assert float(row("compare/improvement.csv", score="final")["probability"]) == pytest.approx(14.5 / 16)
    assert "less is better" in printed


def test_a_metric_without_values_at_first(runs, compare):
    compare(runs, by="meta", metric="length_over_shortest")
    fixed = row("compare/summary.csv", meta="fixed-dfs", graph="all")
    assert float(fixed["final_iqm"]) == pytest.approx(3 - 1.9 * 0.85)
    assert fixed["auc_iqm"] == ""  # nothing has escaped at step 0, so no run has an area
    first, *others = (one for one in rows("compare/curves.csv") if (one["group"], one["graph"]) == ("random", "c"))
    assert first["iqm"] == ""
    assert all(one["iqm"] and one["low"] for one in others)


def test_json_is_what_was_written(runs, compare):
    printed = json.loads(compare(runs, "--json", by="meta"))
    assert printed == json.loads(Path("compare/comparison.json").read_text(encoding="utf-8"))
    assert printed["by"] == ["meta"]
    assert [group["meta"] for group in printed["groups"]] == ["fixed-dfs", "random"]
    assert [len(group["runs"]) for group in printed["groups"]] == [4, 4]
    table = {(one["group"], one["graph"]): one for one in printed["summary"]}
    assert table["random", "c"]["steps_to_95"] is None
    for one in rows("compare/summary.csv"):
        for name, value in table[one["group"], one["graph"]].items():
            if name not in ("group", "graph", "meta"):
                assert number(one[name]) == value, name


def test_the_same_twice_gives_the_same_files(runs, compare):
    compare(runs, by="meta", out="one", draws=True)
    compare(runs, by="meta", out="two", draws=True)
    assert {path.name for path in Path("one").iterdir()} == {
        *("comparison.json", "curves.csv", "curves.pdf", "curves.png", "improvement.csv", "summary.csv")
    }
    for path in Path("one").iterdir():
        assert path.read_bytes() == (Path("two") / path.name).read_bytes(), path.name


def test_graphs_are_strata_and_panels(tmp_path, compare):
    for graph, end in (("a", 1.0), ("g", 0.5)):
        for seed in range(3):
            make_run(tmp_path / "runs" / f"{graph}{seed}", {graph: line(end)}, seed=seed)
    compare(tmp_path / "runs")
    for graph, expected in (("a", 1.0), ("g", 0.5), ("all", 0.75)):
        found = row("compare/summary.csv", graph=graph)
        assert [float(found[f"final_iqm{end}"]) for end in ("", "_low", "_high")] == [expected] * 3
        assert float(found["auc_mean"]) == pytest.approx(expected / 2)


def test_by_default_what_differs(tmp_path, compare):
    for seed in range(2):
        for gamma in (0.99, 0.9):
            make_run(tmp_path / "r" / f"{gamma}{seed}", {"c": line(gamma)}, seed=seed, gamma=gamma, threads=seed + 1)
    printed = compare(tmp_path / "r")
    assert "compared by gamma, as no --by was given" in printed
    assert [one["group"] for one in rows("compare/summary.csv")][::2] == ["gamma 0.9", "gamma 0.99"]  # in their order


def test_by_default_no_more_than_needed(tmp_path, compare):
    for seed in range(2):
        for n, choice in enumerate(({"method": "ppo"}, {"method": "hippo"}, {"meta": "random"})):
            make_run(tmp_path / "r" / f"{n}{seed}", {"c": line(0.5)}, seed=seed, **choice)
    assert "compared by method, meta, as" in compare(tmp_path / "r")
    assert {one["group"] for one in rows("compare/curves.csv")} == {"ppo", "hippo, fixed-dfs", "hippo, random"}


def test_what_a_sweep_calls_a_run_is_what_it_is_called_here(tmp_path, compare):
    for seed in range(2):
        for name, entries in {"slow, HiPPO": {"gamma": 0.9, "learning_rate": 1e-4}, "quick": {"gamma": 0.99}}.items():
            path = make_run(tmp_path / "r" / f"{name}{seed}", {"c": line(0.5)}, seed=seed, **entries)
            record_session(path, RunFolder(path).config(), name)
            record_session(path, RunFolder(path).config())  # it was resumed
    printed = compare(tmp_path / "r")
    assert "compared by variant, as no --by was given" in printed
    assert "the groups differ also in learning_rate, gamma" in printed
    assert [one["group"] for one in rows("compare/summary.csv")][::2] == ["quick", "slow, HiPPO"]
    path = make_run(tmp_path / "r" / "other", {"c": line(0.5)})
    compare(tmp_path / "r", by="variant")
    assert {one["group"] for one in rows("compare/summary.csv")} == {"quick", "slow, HiPPO", "no variant"}
    compare(tmp_path / "r", by="variant,method")
    assert {one["group"] for one in rows("compare/summary.csv")} == {"quick, hippo", "slow, HiPPO, hippo", "hippo"}
    (path / "provenance.json").write_text("[" * 10**5 + "]" * 10**5, encoding="utf-8")
    printed = compare(tmp_path / "r", by="variant")
    assert f"- left out: cannot read {path / 'provenance.json'}: maximum recursion depth exceeded" in printed
    assert {one["group"] for one in rows("compare/summary.csv")} == {"quick", "slow, HiPPO"}
    (path / "provenance.json").unlink()
    shutil.copytree(path, tmp_path / "r" / "renamed")
    record_session(tmp_path / "r" / "renamed", RunFolder(path).config(), "quick")
    with pytest.raises(InputError, match=r"other and .*renamed have the same seed, 0, and"):
        compare(tmp_path / "r", by="gamma")


def test_one_group_is_a_learning_curve(tmp_path, compare):
    for seed in range(2):
        make_run(tmp_path / "r" / str(seed), {"c": line(0.5)}, seed=seed)
    assert "compared by method" in compare(tmp_path / "r")
    assert Path("compare/improvement.csv").read_text(encoding="utf-8").startswith("group,other,score")
    assert rows("compare/improvement.csv") == []


def test_meta_and_reward_are_those_of_the_method(tmp_path, compare):
    for seed in range(2):
        make_run(tmp_path / "r" / f"a{seed}", {"c": line(0.5)}, seed=seed, method="ppo")
        make_run(tmp_path / "r" / f"b{seed}", {"c": line(0.5)}, seed=seed, method="hippo")
    printed = compare(tmp_path / "r", by="meta,reward")
    assert [one["group"] for one in rows("compare/summary.csv")][::2] == ["none, extrinsic", "fixed-dfs, intrinsic"]
    assert "the groups differ also in method" in printed
    assert "not comparable" not in printed
    assert "returns of different rewards (extrinsic, intrinsic) are not comparable" in compare(
        tmp_path / "r", metric="return"
    )


def test_by_graph(tmp_path, compare):
    for graph, end in (("a", 1.0), ("g", 0.5)):
        for seed in range(2):
            make_run(tmp_path / "r" / f"{graph}{seed}", {graph: line(end - seed / 10)}, seed=seed)
    printed = compare(tmp_path / "r", by="graph")
    assert "no goal graph in common" in printed
    assert [one["config_graph"] for one in rows("compare/summary.csv")] == ["a", "a", "g", "g"]
    assert float(row("compare/improvement.csv", score="final")["probability"]) == 1
    assert float(row("compare/summary.csv", group="graph g", graph="all")["final_mean"]) == pytest.approx(0.45)


def test_entries_are_named_as_on_the_command_line(tmp_path, compare):
    for seed in range(2):
        make_run(tmp_path / "r" / f"a{seed}", {"c": line(0.5)}, seed=seed)
        make_run(tmp_path / "r" / f"b{seed}", {"c": line(0.5)}, seed=seed, num_envs=8)
    compare(tmp_path / "r", by="num-envs", out="one")
    compare(tmp_path / "r", by="num_envs, meta-ppo.gamma", out="two")
    assert [one["num_envs"] for one in rows("one/summary.csv")][::2] == ["8", "64"]
    assert rows("two/summary.csv")[0]["meta_ppo.gamma"] == "0.998"


def test_a_warm_start_is_named_without_its_seed(tmp_path, compare):
    for seed in range(2):
        make_run(tmp_path / "r" / f"a{seed}", {"c": line(0.5)}, seed=seed, warm_start=f"runs/hippo-a-seed{seed}")
        make_run(tmp_path / "r" / f"b{seed}", {"c": line(0.5)}, seed=seed)
    compare(tmp_path / "r")
    assert [one["group"] for one in rows("compare/summary.csv")][::2] == ["hippo-a", "no warm start"]


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("hippo-a-seed1", "hippo-a"),
        ("hippo-a-seed12-3", "hippo-a"),
        ("hippo-fixed-dfs-a-seed1-steps500k", "hippo-fixed-dfs-a-steps500k"),
        ("hippo-a-seed1-steps500k-2", "hippo-a-steps500k"),
        ("hippo-a-seed1-fbd761", "hippo-a"),
        ("hippo-a-seed1-gamma0.9-fbd761", "hippo-a-gamma0.9"),
        ("mine-2", "mine-2"),
        ("seedling-seed1s", "seedling-seed1s"),
    ],
)
def test_a_folder_is_named_without_its_seed_wherever_that_stands(tmp_path, folder, name):
    run = make_run(tmp_path / "run", {"a": line(0.5)}, warm_start=f"runs/{folder}")
    assert read_run(run).choice("warm_start") == name


def test_what_a_folder_calls_a_run_is_one_line_that_no_terminal_obeys(tmp_path):
    path = make_run(tmp_path / "run", {"a": line(0.5)}, network="own:\udcff")
    (path / "provenance.json").write_text(r'{"sessions": [{"variant": "=x\ud800\u001b[31m\n"}]}')
    run = read_run(path)
    assert (run.choice("variant"), run.choice("network")) == (r"=x\ud800\x1b[31m\n", r"own:\udcff")


def test_runs_that_are_mixed_are_told(tmp_path, compare):
    for seed, gamma in enumerate((0.9, 0.95)):
        make_run(tmp_path / "r" / f"{seed}", {"c": line(0.5)}, seed=seed, gamma=gamma, size=11 + 2 * seed)
    assert "hippo mixes runs that differ in size (11, 13), gamma (0.9, 0.95)" in compare(tmp_path / "r", by="method")


@pytest.mark.parametrize("differs", ["module", "resumed", "hierroom", "numpy", "weights"])
def test_runs_of_different_code_are_told(tmp_path, compare, monkeypatch, differs):
    (tmp_path / "mine.py").write_text("one")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hierroom.runs.folder.provenance.describe_git", lambda *_: None)
    for seed in range(2):
        path = make_run(tmp_path / "r" / f"{seed}", {"c": line(0.5)}, seed=seed, meta="mine:M", warm_start="base")
        config = RunFolder(path).config()
        record_session(path, config, warm_start=64 * "a")
        assert not seed or "different code" not in compare("r")
    if differs in ("module", "resumed"):
        (tmp_path / "mine.py").write_text("two")
    if differs == "hierroom":
        monkeypatch.setattr("hierroom.__version__", "9.9.9")
    if differs == "numpy":
        monkeypatch.setattr("hierroom.runs.folder.provenance.version", lambda name: "9.9.9")
    if differs != "resumed":
        (path / "provenance.json").unlink()
    record_session(path, config, warm_start=64 * ("b" if differs == "weights" else "a"))
    name = {"module": "mine.py", "resumed": "mine.py", "weights": "the weights of base"}.get(differs, differs)
    told = next(one for one in compare("r").splitlines() if "different code" in one)
    assert told.startswith("- hippo was trained with different code: ")
    assert f"{name} (" in told
    assert ("9.9.9" in told) == (differs in ("hierroom", "numpy"))


def test_an_unfinished_run_ends_the_comparison(runs, compare):
    shutil.rmtree(runs / "random-3")
    make_run(runs / "random-3", {"c": line(0.8)}, steps=(0, 100_000, 500_000), meta="random", seed=3)
    printed = compare(runs, by="meta")
    assert f"unfinished: {runs / 'random-3'} (500,000 of 1,000,000 steps)" in printed
    assert "compared up to 500,000 steps, the end of" in printed
    found = row("compare/summary.csv", group="random", graph="all")
    assert found["steps"] == "500000"
    assert float(found["final_iqm"]) == pytest.approx(0.25)
    assert float(found["auc_iqm"]) == pytest.approx(0.125)
    assert (found["steps_to_50"], found["reached_50"]) == ("", "0.0")  # 0.8 is there after 625,000


def test_unequal_lengths_and_episodes_are_told(runs, compare):
    path = make_run(runs / "random-9", {"c": line(0.8)}, (0, 10**6), episodes=50, meta="random", seed=9)
    text = (path / "config.json").read_text()
    (path / "config.json").write_text(text.replace('"steps": 1000000', '"steps": 900000'))
    printed = compare(runs, by="meta")
    assert "the runs are to train for 900,000 to 1,000,000 steps" in printed
    assert "the evaluations are not alike: they have 50 to 200 episodes each" in printed
    assert "random has unequal" not in printed


def test_other_points_are_interpolated(tmp_path, compare):
    make_run(tmp_path / "r" / "0", {"c": line(0.4)}, steps=(0, 300, 1_000_000), seed=0, num_envs=8)
    make_run(tmp_path / "r" / "1", {"c": line(0.8)}, steps=(0, 12_345, 500_000, 1_000_900), seed=1)
    printed = compare(tmp_path / "r", by="method")
    curve = [one for one in rows("compare/curves.csv") if one["graph"] == "all"]
    assert [int(one["steps"]) for one in curve] == [0, 300, 12_345, 500_000, 1_000_000]
    for one in curve:
        assert float(one["iqm"]) == pytest.approx(0.6 * int(one["steps"]) / 1e6, abs=1e-6)
    assert "compared up to" not in printed  # the ends of whole updates differ by so little
    assert "intervals from fewer than 5 runs on a graph are too narrow: hippo (2)" in printed


def test_a_single_run_has_no_band(tmp_path, compare):
    make_run(tmp_path / "r" / "0", {"c": line(0.4)})
    printed = compare(tmp_path / "r")
    assert "hippo has a single run: no interval" in printed
    assert re.search(r"hippo +1 +40\.0% +20\.0%", printed)
    assert row("compare/summary.csv", graph="c")["final_iqm_low"] == ""


def test_graphs_that_not_all_have_are_left_out(tmp_path, compare):
    for meta, graphs in (("fixed-dfs", "abc"), ("random", "bcd")):
        for graph in graphs:
            for seed in range(2):
                make_run(tmp_path / "r" / f"{meta}{graph}{seed}", {graph: line(0.5)}, meta=meta, seed=seed)
    assert "left out, as not every group has it: graph a, d" in compare(tmp_path / "r", by="meta")
    assert {one["graph"] for one in rows("compare/summary.csv")} == {"all", "b", "c"}


def test_runs_without_evaluations_in_a_folder_are_left_out(runs, compare):
    (runs / "random-3" / "evaluations.csv").unlink()
    printed = compare(runs, by="meta")
    assert f"left out, as it has no evaluations: {runs / 'random-3'}" in printed
    assert row("compare/summary.csv", group="random", graph="all")["n_runs"] == "3"


def test_a_run_given_twice_counts_once(runs, compare):
    compare(runs, runs / "random-1", runs / ".." / "runs" / "random-1", by="meta")
    assert row("compare/summary.csv", group="random", graph="all")["n_runs"] == "4"


@pytest.mark.parametrize(("graphs", "size"), [("c", 1), ("abcdefg", 8)])
def test_the_figure(tmp_path, compare, graphs, size):
    for n, meta in enumerate(("fixed-dfs", "random")):
        for graph in graphs:
            for seed in range(2):
                curve = {graph: rise(100_000 * (seed + 1 + 3 * n))}
                make_run(tmp_path / "r" / f"{meta}{graph}{seed}", curve, meta=meta, seed=seed)
    compare(tmp_path / "r", by="meta", draws=True)
    colours = pixels(Path("compare/curves.png"))
    assert colours.shape[1] == pytest.approx(300 * (3.3 if size == 1 else 6.8), abs=2)
    for colour in COLOURS[:2]:
        assert has_colour(colours, colour).sum() > 500 * size
    assert not has_colour(colours, COLOURS[2]).any()
    document = Path("compare/curves.pdf").read_bytes()
    assert document.startswith(b"%PDF")
    assert b"/FontFile2" in document  # TrueType, embedded
    assert b"/Type3" not in document


def test_many_graphs_have_one_panel(tmp_path, compare):
    names = {f"keys-{n}": line(0.5) for n in range(26)}
    for seed in range(2):
        make_run(tmp_path / "r" / str(seed), names, graph="hitting_time:8..30", seed=seed)
    compare(tmp_path / "r", draws=True)
    assert pixels(Path("compare/curves.png")).shape[1] == pytest.approx(300 * 3.3, abs=2)
    assert len(rows("compare/summary.csv")) == 27


def refused(compare, match, *arguments, **options):
    with pytest.raises(InputError, match=match) as caught:
        compare(*arguments, **options)
    assert "\n" not in str(caught.value)


def test_what_is_not_a_run(tmp_path, runs, compare):
    refused(compare, "nowhere is neither a run folder", tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    refused(compare, "empty is neither a run folder", tmp_path / "empty")
    refused(compare, "give the folders of the runs")
    (runs / "random-0" / "config.json").write_text("{")
    assert f"- left out: cannot read {runs / 'random-0' / 'config.json'}: Expecting" in compare(runs)
    refused(compare, r"cannot read .*random-0.config\.json: Expecting", runs / "random-0")


def test_a_run_without_evaluations(runs, compare):
    (runs / "random-0" / "evaluations.csv").unlink()
    refused(compare, "random-0 has no evaluations.csv; the run was made without", runs / "random-0")
    for path in runs.glob("*/evaluations.csv"):
        path.unlink()
    refused(compare, "no run in .* has evaluations", runs)


def test_a_run_evaluated_only_at_the_start(runs, compare):
    alone = make_run(runs / "random-9", {"c": line(0.8)}, steps=(0,), meta="random", seed=9)
    refused(compare, "random-9 was evaluated up to 0 steps only", alone, *runs.glob("random-0"))
    assert find_runs([runs])[1] == [alone]  # among others in a folder it is left out


def test_a_copy_of_a_run(runs, compare):
    shutil.copytree(runs / "random-0", runs / "random-copy")
    refused(compare, "random-0 and .*random-copy have the same seed, 0, and differ at most in steps", runs)


def test_a_run_that_a_sweep_evaluated_otherwise_later_counts_once(tmp_path, compare):
    for digest in ("aaaaaa", "bbbbbb"):
        make_run(tmp_path / "s" / "runs" / f"hippo-a-seed0-{digest}", {"a": line(0.5)})
    (tmp_path / "s" / "sweep.csv").write_text("method,digest\nhippo,bbbbbb0123456789\n")
    assert [path.name for path in find_runs([tmp_path / "s"])[0]] == ["hippo-a-seed0-bbbbbb"]
    make_run(tmp_path / "s" / "runs" / "hippo-a-seed0-cccccc", {"a": line(0.5)}, seed=1)
    assert len(find_runs([tmp_path / "s"])[0]) == 2, "a run that has no row yet is one of its own"
    compare(tmp_path / "s")


def test_two_graphs_of_the_same_name(tmp_path, compare):
    for keys in ("[0, 1, 0]", "[0, 0, 0]"):
        (tmp_path / "mine.toml").write_text(f"key_rooms = {keys}\nexit_room = 3\n")
        make_run(tmp_path / "r" / keys, {"mine": line(0.5)}, graph=str(tmp_path / "mine.toml"))
    refused(compare, "two different goal graphs are called mine", tmp_path / "r")


def test_an_unknown_entry(runs, compare):
    refused(compare, "not 'metta'; is it meta\\?", runs, by="metta")
    refused(
        compare,
        "not 'qq'; they are .*gamma, .*meta, meta_features, meta_start_success.*, and the learner.s of meta_ppo too",
        runs,
        by="qq",
    )
    refused(compare, "not ''", runs, by="meta,")


def test_groups_without_a_graph_in_common(tmp_path, compare):
    make_run(tmp_path / "r" / "a", {"a": line(0.5)}, meta="random")
    make_run(tmp_path / "r" / "c", {"c": line(0.5)})
    wanted = r"no goal graph in common \(random: a; fixed-dfs: c\); add graph to --by"
    refused(compare, wanted, tmp_path / "r", by="meta")


def test_too_many_groups(tmp_path, compare):
    for n in range(29):
        make_run(tmp_path / "r" / str(n), {"c": line(0.5)}, num_envs=n + 1)
    refused(compare, "by num_envs there are 29 groups; at most 28", tmp_path / "r")


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda text: text.replace("length_over_shortest", "detour"), "has no column length_over_shortest"),
        (lambda text: text + text.splitlines()[-1] + "\n", "the steps of graph c do not increase"),
        (lambda text: text.replace(",200,", ",,"), "line 2: episodes is a whole number of at least 1, not ''"),
        (lambda text: text.replace(",0.2,", ",7,"), "line 22: success_rate is a number from 0 to 1, not '7'"),
        (lambda text: text.replace(",0.2,", ",nan,"), "line 22: success_rate is a number from 0 to 1, not 'nan'"),
        (lambda text: text.replace(",0.4,", ",-inf,"), "line 22: return is a number of at least .*, not '-inf'"),
        (lambda text: text.encode("utf-16").decode("latin-1"), "line 1 is no row of text"),
    ],
)
def test_broken_evaluations_are_left_out_with_their_line(runs, compare, change, match):
    path = runs / "random-0" / "evaluations.csv"
    path.write_text(change(path.read_text()), encoding="latin-1", newline="")
    printed = compare(runs, by="meta")
    assert re.search(f"left out: .*random-0/evaluations.csv is broken: .*{match}", printed)
    assert row("compare/summary.csv", group="random", graph="all")["n_runs"] == "3"
    refused(compare, f"evaluations.csv is broken: .*{match}", runs / "random-0")


def test_a_run_without_a_value_of_the_metric_is_named(runs, compare):
    path = runs / "random-2" / "evaluations.csv"
    *before, last = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*before, last.rpartition(",")[0], ",nan\n"]))
    printed = compare(runs, by="meta", metric="length_over_shortest")
    assert "random has no length_over_shortest at 2 of 21 steps, nor an area: not known of " in printed
    assert "random-0, " in printed.partition("random has no")[2]  # where nobody escapes, none has a value


def test_without_a_folder_each_comparison_gets_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figure, "draw_comparison", lambda comparison, folder: [])
    make_run(tmp_path / "r", {"c": line(0.5)})
    for _ in range(2):
        assert command.main(["r", "--resamples", "100"]) == 0
    assert sorted(path.name for path in tmp_path.glob("compare*")) == ["compare", "compare-2"]


def test_a_folder_of_something_else_is_not_touched(runs, compare):
    Path("mine").mkdir()
    Path("mine/curves.csv").write_text("precious", encoding="utf-8")
    refused(compare, "mine is neither an empty folder nor that of an earlier comparison", runs, out="mine")
    Path("file").touch()
    refused(compare, "file is neither an empty folder", runs, out="file")
    refused(compare, "cannot create the folder file.below", runs, by="meta", out="file/below")
    assert Path("mine/curves.csv").read_text(encoding="utf-8") == "precious"
    refused(compare, "nowhere is neither", "nowhere", out="unused")
    assert not Path("unused").exists()
    compare(runs, by="meta", out="again")
    compare(runs, by="method", out="again")  # its own is replaced
    assert "method" in rows("again/summary.csv")[0]


def test_numbers_out_of_range(runs, compare):
    refused(compare, "resamples must be at least 100, not 5", runs, resamples=5)
    refused(compare, "seed must be at least 0, not -1", runs, seed=-1)


def test_brackets_are_no_markup(tmp_path, compare):
    for seed in range(2):
        make_run(tmp_path / "r" / f"[red]{seed}", {"c": line(0.5)}, seed=seed, network="own:[bold]")
    printed = compare(tmp_path / "r", by="network", out="[blue]")
    assert re.search(r"^ own:\[bold\] +2 ", printed, re.MULTILINE)
    assert "written: [blue]/comparison.json" in printed
    assert row("[blue]/summary.csv", network="own:[bold]", graph="c")["final_iqm"] == "0.5"


def test_no_two_lines_of_a_figure_look_the_same():
    styles = [line_style(number) for number in range(MAX_GROUPS)]
    assert len(set(styles)) == MAX_GROUPS == len(COLOURS) * len(DASHES)
    assert all(one[0] != other[0] and one[1] != other[1] for one, other in pairwise(styles))


def test_steps_are_counted_in_thousands_where_there_are_few():
    assert [step_unit(most)[1] for most in (20_480, 199_999, 200_000, 10**7)] == [*["thousands"] * 2, *["millions"] * 2]
