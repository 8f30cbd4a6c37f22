"""A comparison: its tables in CSV, in JSON and as printed, its notes, and its figure."""

import json
import re
import shutil
from pathlib import Path

import pytest
from evaluated_runs import line, make_run, rise, row, rows
from pictures import has_colour, pixels

from hierroom.lab.compare.style import COLOURS


def test_summary_improvement_and_curves_by_hand(runs, compare):
    printed = compare(runs, by="meta")
    random = row("compare/summary.csv", meta="random", graph="c")
    # 0.2, 0.4, 0.6 and 0.8: the middle two are 0.4 and 0.6; half of that is under straight lines from 0
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
    printed = compare(runs, by="meta", outcome="length")
    fixed = row("compare/summary.csv", meta="fixed-dfs", graph="all")
    assert float(fixed["final_iqm"]) == pytest.approx(1000 - 950 * 0.85)
    assert float(row("compare/improvement.csv", score="final")["probability"]) == pytest.approx(14.5 / 16)
    assert "less is better" in printed


def test_metric_without_first_values_has_no_area(runs, compare):
    path = runs / "random-2" / "evaluations.csv"
    *before, last = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*before, last.rpartition(",")[0], ",nan\n"]))
    printed = compare(runs, by="meta", outcome="length_over_shortest")
    fixed = row("compare/summary.csv", meta="fixed-dfs", graph="all")
    assert float(fixed["final_iqm"]) == pytest.approx(3 - 1.9 * 0.85)
    assert fixed["auc_iqm"] == ""  # nothing has escaped at step 0, so no run has an area
    first, *others = (one for one in rows("compare/curves.csv") if (one["group"], one["graph"]) == ("fixed-dfs", "c"))
    assert first["iqm"] == ""
    assert all(one["iqm"] and one["low"] for one in others)
    assert "random has no length_over_shortest at 2 of 21 steps, nor an area: not known of " in printed
    assert "random-0, " in printed.partition("random has no")[2]  # where nobody escapes, none has a value


def test_printed_json_equals_the_written_file(runs, compare):
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
                assert (float(one[name]) if one[name] else None) == value, name


def test_graphs_are_strata_unless_grouped_by_graph(tmp_path, compare):
    for graph, end in (("a", 1.0), ("g", 0.5)):
        for seed in range(3):
            make_run(tmp_path / "r" / f"{graph}{seed}", {graph: line(end)}, seed=seed)
    assert "compared by method, as no --by was given" in compare(tmp_path / "r")
    for graph, expected in (("a", 1.0), ("g", 0.5), ("all", 0.75)):
        found = row("compare/summary.csv", graph=graph)
        assert [float(found[f"final_iqm{end}"]) for end in ("", "_low", "_high")] == [expected] * 3
        assert float(found["auc_mean"]) == pytest.approx(expected / 2)
    assert "no goal graph in common" in compare(tmp_path / "r", by="graph")
    assert [one["config_graph"] for one in rows("compare/summary.csv")] == ["a", "a", "g", "g"]
    assert float(row("compare/improvement.csv", score="final")["probability"]) == 1
    assert float(row("compare/summary.csv", group="graph g", graph="all")["final_mean"]) == 0.5


def test_unfinished_run_limits_the_compared_steps(runs, compare):
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


def make_sparse_run(path, *missing, seed=0):
    """Make a run on graphs a to c whose evaluations lack some of them, as (steps, graph)."""
    make_run(path, dict.fromkeys("abc", line(0.8)), (0, 10**5, 5 * 10**5, 10**6), graph=("a", "b", "c"), seed=seed)
    lines = (path / "evaluations.csv").read_text().splitlines(keepends=True)
    left = [s for s in lines if not any(s.startswith(f"{steps},") and f",{graph}," in s for steps, graph in missing)]
    (path / "evaluations.csv").write_text("".join(left))
    return path


def test_evaluations_that_lack_graphs_are_reported(tmp_path, compare):
    late = make_sparse_run(tmp_path / "late", (0, "a"), seed=0)
    printed = compare(late, make_sparse_run(tmp_path / "whole", seed=1))
    assert f"compared from 100,000 steps on, as earlier evaluations of {late} lack some of its graphs" in printed
    assert float(row("compare/summary.csv", graph="all")["auc_mean"]) == pytest.approx((0.08 + 0.8) / 2)
    printed = compare(early := make_sparse_run(tmp_path / "early", (10**6, "b")))
    assert f"compared up to 500,000 steps, the end of {early}" not in printed
    assert "unfinished" not in printed
    assert row("compare/summary.csv", graph="all")["steps"] == "500000"


def test_graph_met_in_a_single_evaluation_is_not_compared(tmp_path, compare, refused):
    compare(make_sparse_run(tmp_path / "whole"))
    assert "b" in {one["graph"] for one in rows("compare/summary.csv")}
    printed = compare(make_sparse_run(tmp_path / "once", (0, "b"), (10**5, "b"), (10**6, "b")))
    assert "not compared, as no run met it in two evaluations: graph b" in printed
    assert {r["graph"]: r["steps"] for r in rows("compare/summary.csv")} == dict.fromkeys(("all", *"ac"), "1000000")
    apart = make_sparse_run(tmp_path / "apart", *[(steps, graph) for steps in (10**5, 10**6) for graph in "abc"])
    table = apart / "evaluations.csv"
    table.write_text("".join(one for n, one in enumerate(table.read_text().splitlines(True)) if n in (0, 1, 5)))
    refused("apart was evaluated up to 0 steps only", apart)  # graph a at step 0, b later


def test_run_alone_with_its_graphs_leaves_no_interval(tmp_path, compare):
    every = [(steps, "b") for steps in (0, 10**5, 5 * 10**5, 10**6)]
    paths = [make_sparse_run(tmp_path / f"{seed}", *every * (seed == 2), seed=seed) for seed in range(5)]
    assert f"no interval over all graphs: no other run has exactly those of {paths[2]}" in compare(*paths)
    assert row("compare/summary.csv", graph="all")["final_iqm_low"] == ""
    assert row("compare/summary.csv", graph="b")["final_iqm_low"] == "0.8"


def test_unequal_lengths_and_episodes_are_reported(runs, compare):
    path = make_run(runs / "random-9", {"c": line(0.8)}, (0, 10**6), episodes=50, meta="random", seed=9)
    text = (path / "config.json").read_text()
    (path / "config.json").write_text(text.replace('"steps": 1000000', '"steps": 900000'))
    printed = compare(runs, by="meta")
    assert "the runs are to train for 900,000 to 1,000,000 steps" in printed
    assert "the evaluations are not alike: they have 50 to 200 episodes each" in printed
    assert "random has unequal" not in printed


def test_evaluations_at_different_steps_are_interpolated(tmp_path, compare):
    make_run(tmp_path / "r" / "0", {"c": line(0.4)}, steps=(0, 300, 1_000_000), seed=0, num_envs=8)
    make_run(tmp_path / "r" / "1", {"c": line(0.8)}, steps=(0, 12_345, 500_000, 1_000_900), seed=1)
    printed = compare(tmp_path / "r", by="method")
    curve = [one for one in rows("compare/curves.csv") if one["graph"] == "all"]
    assert [int(one["steps"]) for one in curve] == [0, 300, 12_345, 500_000, 1_000_000]
    for one in curve:
        assert float(one["iqm"]) == pytest.approx(0.6 * int(one["steps"]) / 1e6, abs=1e-6)
    assert "compared up to" not in printed  # the ends of whole updates differ by so little
    assert "intervals from fewer than 5 runs on a graph are too narrow: hippo (2)" in printed


def test_single_run_has_no_interval(tmp_path, compare):
    make_run(tmp_path / "r", {"c": line(0.4)})
    for out in ("compare", "compare-2"):
        printed = compare(tmp_path / "r", out=None, resamples=100)
        assert "compared by method" in printed
        assert "hippo has a single run: no interval" in printed
        assert re.search(r"hippo +1 +40\.0% +20\.0%", printed)
        assert row(f"{out}/summary.csv", graph="c")["final_iqm_low"] == ""
        assert Path(out, "improvement.csv").read_text(encoding="utf-8").startswith("group,other,score")
        assert rows(f"{out}/improvement.csv") == []


def test_graphs_missing_from_a_group_are_left_out(tmp_path, compare):
    for meta, graphs in (("fixed-dfs", "abc"), ("random", "bcd")):
        for graph in graphs:
            for seed in range(2):
                make_run(tmp_path / "r" / f"{meta}{graph}{seed}", {graph: line(0.5)}, meta=meta, seed=seed)
    assert "left out, as not every group has it: graph a, d" in compare(tmp_path / "r", by="meta")
    assert {one["graph"] for one in rows("compare/summary.csv")} == {"all", "b", "c"}


@pytest.mark.parametrize(("graphs", "size"), [("c", 1), pytest.param("abcdefg", 8, marks=pytest.mark.slow)])
def test_compare_figure_size_colours_and_fonts(tmp_path, compare, graphs, size):
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
    if size == 1:
        compare(tmp_path / "r", by="meta", out="again", draws=True)
        names = {"comparison.json", "curves.csv", "curves.pdf", "curves.png", "improvement.csv", "summary.csv"}
        assert {path.name for path in Path("compare").iterdir()} == names
        for name in names:
            assert (Path("compare") / name).read_bytes() == (Path("again") / name).read_bytes(), name


def test_many_graphs_have_one_panel(tmp_path, compare):
    names = {f"keys-{n}": line(0.5) for n in range(26)}
    for seed in range(2):
        make_run(tmp_path / "r" / str(seed), names, graph="hitting_time:8..30", seed=seed)
    compare(tmp_path / "r", draws=True)
    assert pixels(Path("compare/curves.png")).shape[1] == pytest.approx(300 * 3.3, abs=2)
    assert len(rows("compare/summary.csv")) == 27
