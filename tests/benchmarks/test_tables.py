"""The tables of sweeps in README and docs equal those of their committed rows."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import committed, hindsight, tables
from benchmarks.result_table import ResultTable
from benchmarks.study import page_tables
from benchmarks.study.correlations import correlations
from benchmarks.study.tables import first_seeds, measures_for, read_rows
from benchmarks.study.trained import by_rule, measures_of, medians, read_trained
from hierroom.lab.sweep.summary import Summary
from hierroom.support.errors import InputError

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: page.name)
def test_tables_on_pages_equal_their_rows(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    for path, text in {page: tables.renewed(page.read_text()), **tables.files_of(page)}.items():
        assert path.read_text() == text, "python -m benchmarks.tables renews it"


def test_every_sweep_has_a_table_on_a_page():
    named = {word for page in tables.PAGES for _, words in tables.named_tables(page.read_text()) for word in words}
    swept = {path.stem for path in (ROOT / "benchmarks" / "sweeps").glob("*.toml")}
    elsewhere = {"study_twins", "study_twins_paper_features", "sketch_size25"}
    assert swept - named <= elsewhere  # rows of other sweeps


def test_linked_file_is_written_from_its_table(monkeypatch, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("| [one](rows/one.csv)<!-- sweep one --> | text |\n[two](two.csv) is as it is\n")
    monkeypatch.setitem(
        tables.MAKERS, "sweep", lambda name: f"`command`:\n\n| {name} | b |\n|---|---|\n|  | x\\|y |\n| , |  |\n"
    )
    assert tables.files_of(page) == {tmp_path / "rows" / "one.csv": 'one,b\n,x|y\n",",\n'}
    assert tables.named_tables(page.read_text()) == [("sweep", ["one"])]
    monkeypatch.setitem(tables.MAKERS, "sweep", lambda name: 2 * "| a |\n|---|\n| b |\n\n")
    with pytest.raises(InputError, match="sweep one is not one table"):
        tables.files_of(page)


def test_a_matrix_has_the_graphs_in_columns(monkeypatch):
    headings = ("variant", "graph", "runs", "steps to 95%")
    lines = (("x", "b", "2", "7k"), ("x", "a", "2", "5k"), ("y", "a", "2", "-"))
    monkeypatch.setattr(tables, "done_rows", lambda name, runs: name)
    monkeypatch.setattr(tables, "summarise", lambda runs, rows: Summary(headings, 2, lines, ""))
    assert tables.matrix_table("steps_to_95", "long").split("\n")[1:-2] == [
        "| steps to 95 | a | b |",
        "|---|---:|---:|",
        "| x | 5k | 7k |",
        "| y | - |  |",
    ]
    with pytest.raises(InputError, match=r"the table of long has the columns .*; there is no 'success'"):
        tables.matrix_table("success", "long")


def test_renewed_replaces_only_finished_tables(monkeypatch):
    text = "before\n<!-- sweep one -->\nold\n<!-- end of sweep -->\nafter\n<!-- sweep two -->\n<!-- end of sweep -->\n"
    monkeypatch.setitem(tables.MAKERS, "sweep", lambda name: f"| {name} |\n")
    assert tables.renewed(text) == (
        "before\n<!-- sweep one -->\n| one |\n<!-- end of sweep -->\nafter\n"
        "<!-- sweep two -->\n| two |\n<!-- end of sweep -->\n"
    )
    monkeypatch.undo()
    monkeypatch.chdir(ROOT)
    with pytest.raises(InputError, match="<!-- paper 19 --> needs size, n_seeds: missing a required argument"):
        tables.renewed("<!-- paper 19 -->\n<!-- end of paper -->\n")
    with pytest.raises(InputError, match="<!-- factors study ten --> needs a whole number, not 'ten'"):
        tables.renewed("<!-- factors study ten -->\n<!-- end of factors -->\n")
    with pytest.raises(InputError, match=r"\d+ of 700 runs of the sweep hippo are done"):
        tables.sweep_table("hippo", "100")


def test_page_with_unfinished_table_does_not_block_others(monkeypatch, tmp_path, capsys):
    pages = [tmp_path / name for name in ("first.md", "second.md")]
    for page, name in zip(pages, ("unfinished", "whole"), strict=True):
        page.write_text(f"<!-- sweep {name} -->\nold\n<!-- end of sweep -->\n")

    def table(name):
        if name == "unfinished":
            raise InputError("1 of 2 runs are done")
        return "new\n"

    monkeypatch.setitem(tables.MAKERS, "sweep", table)
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    monkeypatch.setattr(tables, "PAGES", tuple(pages))
    for argument, printed, second in (("--check", "differs: second.md\n", "old"), ("", "renewed: second.md\n", "new")):
        monkeypatch.setattr(sys, "argv", ["tables", *argument.split()])
        with pytest.raises(InputError, match=r"^first\.md is left as it is: 1 of 2 runs are done$"):
            tables.main()
        assert capsys.readouterr().out == printed
        assert [page.read_text().splitlines()[1] for page in pages] == ["old", second]


def test_sweep_table_has_notes_on_variants(tmp_path, monkeypatch):
    path = tmp_path / "notes.csv"
    summary = Summary(("variant", "runs"), 1, (("first", "3"), ("second", "-"), ("third", "1")), "")
    assert tables.with_notes(summary, path) is summary
    path.write_text("variant,note\nsecond,nothing\nfirst,rules\n")
    given = tables.with_notes(summary, path)
    assert given.headings == ("variant", "note", "runs")
    assert given.lines == (("first", "rules", "3"), ("second", "nothing", "-"), ("third", "", "1"))


def test_measures_table_equals_the_written_correlations(tmp_path, monkeypatch):
    for module in (committed, page_tables):
        monkeypatch.setattr(module, "ROOT", tmp_path)
    folder = tmp_path / "benchmarks" / "results" / "one"
    folder.mkdir(parents=True)
    (tmp_path / "benchmarks" / "sweeps").mkdir()
    plan = tmp_path / "benchmarks" / "sweeps" / "one.toml"
    plan.write_text("seeds = 3\n")
    statistics = ("spearman", "kendall", "given goals", "given exit depth", "at fixed goals")
    statistics += ("minus goals", "minus exit depth", "minus hitting time")
    rows = [
        f"hippo,steps_to_95,{measure},{one},{value},,,9,3,3"
        for measure, value in (("width", 0.25), ("goals", 0.5))
        for one in statistics
    ]
    rows += ["hippo,steps_to_95,seeds,halves,0.75,0.5,1,9,3,3", "hippo,steps_to_95,seeds,never,2,,,9,3,3"]
    rows += ["hippo,steps_to_95,twins,spearman,,,,0,3,3", "hippo,steps_to_95,twins,factor,,,,0,3,3"]
    (folder / "correlations.csv").write_text(
        "method,outcome,measure,statistic,value,low,high,graphs,seeds_min,seeds_max\n" + "\n".join(rows)
    )
    lines = tables.renewed("<!-- measures one -->\n<!-- end of measures -->\n").splitlines()
    assert [line.split(" | ")[:2] for line in lines if line.startswith("| ")][1:] == [
        ["| goals", "0.50"],
        ["| width", "0.25"],
    ]
    beside = tables.renewed("<!-- measures one width -->\n<!-- end of measures -->\n").splitlines()
    assert beside[2].endswith("/results/one/correlations.csv` prints these among others:")
    assert beside[4] == "| measure | hippo: steps to 95% | hippo: minus exit depth |"
    assert beside[6] == "| width | 0.25 | 0.25 |"
    with pytest.raises(InputError, match="the measures of hippo are goals, width; there is no 'luck'"):
        page_tables.measures_table("one", "luck")
    plan.write_text("seeds = 10\n")
    (command,) = (line for line in page_tables.measures_table("one").splitlines() if line.startswith("`"))
    assert "/one/sweep.csv --seeds 3 --out benchmarks/results/one/correlations.csv` prints" in command
    assert "goals | 0.50" not in tables.renewed("<!-- measures one width -->\n<!-- end of measures -->\n")
    path = folder / "correlations.csv"
    (folder / "correlations_steps_to_50.csv").write_text(path.read_text().replace("steps_to_95", "steps_to_50"))
    at_50 = page_tables.measures_table("one", "steps_to_50", "width").splitlines()
    assert "--seeds 3 --outcome steps_to_50 --out benchmarks/results/one/correlations_steps_to_50.csv`" in at_50[1]
    assert at_50[3].startswith("| measure | hippo: steps to 50% |")
    assert [line.split(" | ")[0] for line in at_50 if line.startswith("| ")] == ["| measure", "| width"]
    path.write_text(path.read_text().replace(",3,3\n", ",2,3\n"))
    with pytest.raises(InputError, match="of 2 to 3 seeds; make it of as many of each"):
        page_tables.measures_table("one")


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ("<!-- swep hippo -->\n<!-- end of swep -->\n", "a table is one of sweep, measures, .*, not swep"),
        ("<!-- sweep hippo -->\n", "1 lines name a table and 0 end one, where 0 tables are found"),
        (
            "<!-- sweep hippo -->\n\n<!-- sweep size31 -->\n\n<!-- end of sweep -->\n",
            "2 lines name a table and 1 end one, where 1 tables are found",
        ),
        ("<!-- factors study 2 ppo-bonus, 0.98 -->\n<!-- end of factors -->\n", "there is no 'ppo-bonus, 0.98'"),
    ],
)
def test_invalid_table_marks_raise_input_error(monkeypatch, page, said):
    monkeypatch.setitem(tables.MAKERS, "sweep", lambda name: "")
    with pytest.raises(InputError, match=said):
        tables.renewed(page)


def test_result_table_is_published_and_read_back(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    path = tmp_path / "benchmarks" / "results" / "size.csv"
    path.parent.mkdir(parents=True)
    table = ResultTable(("graph", "a, b"), (("x|y", "1,5"), ("z", "")))
    table.publish(None)
    printed = capsys.readouterr().out
    assert printed == "| graph | a, b |\n|---|---:|\n| x\\|y | 1,5 |\n| z |  |\n"
    assert not path.exists()
    table.publish(path)
    assert path.read_text() == 'graph,"a, b"\nx|y,"1,5"\nz,\n'
    assert ResultTable.read(path) == table
    assert (
        tables.renewed("<!-- result size -->\nold\n<!-- end of result -->\n").splitlines()[2:-2] == printed.splitlines()
    )
    with pytest.raises(
        InputError, match=r"there is no table .*width\.csv; the benchmark that measures it writes it with --out"
    ):
        tables.result_table("width")


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks" / "results").glob("*/correlations*.csv")), ids=str)
def test_committed_statistics_equal_recomputed_ones(path):
    measured, given = measures_for(path), read_rows(path)
    goals = {row["graph"]: float(row["goals"]) for row in measured}
    rows = first_seeds(read_rows(path.with_name("sweep.csv")), int(given[0]["seeds_max"]))
    milestone = path.stem.removeprefix("correlations").removeprefix("_")
    trained_by = {milestone: read_trained(rows, measured, milestone)} if milestone else by_rule(rows, measured)
    found = [(outcome, one) for outcome, several in trained_by.items() for one in several]
    assert {(outcome, one.method) for outcome, one in found} == {(row["outcome"], row["method"]) for row in given}
    for _, trained in found:
        measures = measures_of(trained.graphs, measured)
        now = correlations(medians(trained.outcomes), measures, np.array([goals[graph] for graph in trained.graphs]))
        own = [row for row in given if row["method"] == trained.method and row["measure"] in measures]
        assert len(own) == len(now)
        for row in own:
            value = now[row["measure"], row["statistic"]]
            assert float(row["value"] or "nan") == pytest.approx(value, rel=1e-5, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    ("make", "sweep", "runs"),
    [
        (page_tables.hierarchy_table, "study", 158),
        (page_tables.factors_table, "study_factors", 288),
        (page_tables.comparisons_table, "study_factors", 288),
        (page_tables.levels_table, "study_levels", 24),
    ],
)
def test_table_of_unfinished_seeds_raises_input_error(monkeypatch, make, sweep, runs):
    monkeypatch.setattr(committed.SweepTable, "of", lambda self, runs: [])
    for n_seeds in (1, 3):
        with pytest.raises(InputError, match=f"^0 of {n_seeds * runs} runs of the sweep {sweep} are done"):
            make(sweep, str(n_seeds))
    with pytest.raises(InputError, match=f"^0 of {2 * 7} runs of the sweep hippo are done"):
        tables.sweep_table("hippo", "2")
    with pytest.raises(InputError, match=r"^0 of 36 runs of the sweep tuning are done"):
        page_tables.tuning_table("tuning", "tuning_others")


def test_unknown_method_word_raises_input_error():
    with pytest.raises(InputError, match="the table's methods are hippo, ppo-bonus; there is no 'steps_to_60'"):
        page_tables.hierarchy_table("study", "10", "steps_to_60")


def test_hindsight_differences_are_not_significant(capsys):
    hindsight.main()
    lines = [line.strip() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert len(lines) == 2 + 4 * 3
    differences = re.findall(r"([+-]\d+(?:\.\d+)?) ± (\d+(?:\.\d+)?)", "\n".join(lines))
    assert len(differences) == 2 * 4 * 3
    assert all(abs(float(value)) <= float(half) for value, half in differences)
    page = " ".join((ROOT / "docs" / "results.md").read_text().split())
    claim = "Eight seeds with this and eight without do not differ significantly in success or length (`python -m"
    assert claim in page


def test_hindsight_differences_pair_equal_seeds():
    rows = [
        {"hindsight": arm, "graph": "d", "seed": seed, "length": value}
        for arm, seed, value in (("yes", "1", "5"), ("no", "0", "7"), ("no", "1", "1"), ("yes", "0", "3"))
    ]
    assert hindsight.differences(rows, "d", "length").tolist() == [4, -4]
