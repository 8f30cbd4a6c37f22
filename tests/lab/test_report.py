"""The page of a report shows its runs, and escapes all texts that come from a run."""

import json
import re
import shutil

import numpy as np
import pytest
from evaluated_runs import line, make_run
from report_page import HOSTILE, Page, hostile_run

import hierroom
from hierroom.commands.report import main
from hierroom.lab.compare.comparison import compare
from hierroom.lab.compare.evaluated_run import read_run, runs_inside
from hierroom.lab.compare.grouping import group_runs
from hierroom.lab.compare.tasks import Tasks
from hierroom.lab.report.curves import RESAMPLES, compare_runs, curve_rows, training_goals
from hierroom.lab.report.page import script_json
from hierroom.lab.report.runs import read_runs
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder of three small runs: two seeds, and another meta-controller that learns."""
    out = tmp_path_factory.mktemp("reported")
    common = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 16, "minibatches": 2, "steps": 1024, "film": False}
    common |= {"evaluations": 3, "evaluation_episodes": 10}
    for seed in (0, 1):
        hierroom.train(meta="fixed-dfs", seed=seed, out=out / "runs" / f"dfs{seed}", **common)
    hierroom.train(meta="learned", out=out / "runs" / "learned", **common)
    return out


def report(tmp_path, *arguments):
    out = tmp_path / "report.html"
    played = () if "--replays" in arguments else ("--played", "20")
    assert main([*map(str, arguments), "--out", str(out), *played]) == 0
    return Page(out)


@pytest.fixture(scope="module")
def page(runs, tmp_path_factory):
    return report(tmp_path_factory.mktemp("page"), runs)


def test_page_loads_no_external_resources(page):
    assert not [(tag, name) for tag, names in page.elements for name in names if name in ("src", "srcset", "action")]
    links = [names["href"] for tag, names in page.elements if "href" in names]
    assert links
    assert all(link.startswith("#") for link in links)
    policy = next(names["content"] for tag, names in page.elements if names.get("http-equiv"))
    assert policy.startswith("default-src 'none';")
    assert len(page.source) < 3e6


def test_embedded_plotly_is_complete(page):
    from plotly.offline import get_plotlyjs

    assert page.plotly == get_plotlyjs()


def test_report_curves_equal_compare_curves(page, runs):
    groups = group_runs([read_run(path) for path in runs_inside(runs)], ("meta",))
    tasks = Tasks.common(groups)
    for metric in ("success_rate", "length"):
        comparison = compare(groups, tasks, metric, RESAMPLES, 0)
        for summary in comparison.of_graph("a"):
            number = comparison.groups.index(summary.group)
            assert page.data["groups"][number]["label"] == summary.group.label
            (drawn,) = [
                curve
                for curve in page.data["curves"]
                if (curve["group"], curve["graph"], curve["metric"]) == (number, "a", metric)
            ]
            np.testing.assert_allclose(drawn["values"], summary.curve.values, rtol=1e-4)
            lows = np.array([np.nan if low is None else low for low in drawn["lows"]])
            np.testing.assert_allclose(lows, summary.curve.lows, rtol=1e-4)


def test_graph_missing_from_a_group_has_curves(tmp_path):
    for name, meta, graph in (("one", "fixed-dfs", "a"), ("two", "random", "a"), ("three", "random", "b")):
        make_run(tmp_path / name, {graph: line(1.0)}, meta=meta)
    curves = compare_runs(read_runs([tmp_path])[0], None)
    found = {(curves.labels[row["group"]], row["graph"], row["n"]) for row in curve_rows(curves)}
    assert found == {("fixed-dfs", "a", 1), ("random", "a", 1), ("random", "b", 1)}


def test_report_pairs_steps_to_success_with_complexity(tmp_path, capsys):
    for graph, end, start, drops in (("a", 1.0, 0.0, False), ("c", 0.4, 0.0, False), ("a", 1.0, 1.0, True)):
        make_run(tmp_path / "in" / f"{graph}{drops}", {graph: line(end, start)}, drop_key=drops)
    page = report(tmp_path, tmp_path / "in")
    points = {point["label"]: point["steps_to"] for point in page.data["points"]}
    assert points["a"] == pytest.approx({"50": 500_000, "90": 900_000, "95": 950_000}, rel=1e-4)
    assert points["c"] == {"50": None, "90": None, "95": None}
    assert points["a, keys can be dropped"]["95"] == 0
    measures = {row["label"]: row["measures"] for row in page.data["complexity"]}
    steps = {label: row["expected_steps"] for label, row in measures.items()}
    assert steps == pytest.approx({"a": 28.007, "c": 73.822, "a, keys can be dropped": 40.488}, abs=1e-3)
    assert points.keys() == steps.keys()
    assert measures["a"]["hitting_time"] == pytest.approx(8.36, abs=0.005)
    assert "a, keys can be dropped40.49" in "".join(page.text.split("\n")).replace("  ", "")
    assert re.search("not played: .* has no checkpoint", capsys.readouterr().out)
    assert page.data["replays"] == []
    assert '<section id="replay"' not in page.source


def test_unplayable_runs_do_not_count_as_replays(runs, tmp_path, capsys):
    for name in ("one", "two"):
        make_run(tmp_path / "in" / name, {"a": line(1.0)})
    shutil.copytree(runs / "runs" / "dfs0", tmp_path / "in" / "whole")
    page = report(tmp_path, tmp_path / "in", "--replays", 1)
    assert [replay["run"] for replay in page.data["replays"]] == ["whole"]
    assert "episodes were played by 1 of 3 runs\n" in capsys.readouterr().out, "there is nothing more to play"
    shutil.copytree(runs / "runs" / "learned", tmp_path / "in" / "other")
    report(tmp_path, tmp_path / "in", "--replays", 1)
    assert "episodes were played by 1 of 4 runs; --replays N plays more\n" in capsys.readouterr().out


def test_incomparable_runs_are_shown_one_by_one(tmp_path):
    for name in ("one", "same"):
        make_run(tmp_path / "in" / name, {"a": line(1.0)})
    page = report(tmp_path, tmp_path / "in", "--replays", 0)
    assert "the runs are shown one by one: " in page.text
    assert [group["label"] for group in page.data["groups"]] == ["one", "same"]
    assert page.data["curves"] == []
    assert len(page.data["runs"]) == 2


def test_a_run_without_evaluations_has_no_curve_but_a_replay(runs, tmp_path):
    shutil.copytree(runs / "runs" / "dfs0", tmp_path / "run")
    (tmp_path / "run" / "evaluations.csv").unlink()
    page = report(tmp_path, tmp_path / "run", "--episodes", 2)
    assert "no learning curve: " in page.text
    assert '<section id="learning"' not in page.source
    assert len(page.data["replays"][0]["episodes"]) == 2
    with pytest.raises(InputError, match="--by takes entries of a run's config, joined by commas, not 'nothing'"):
        report(tmp_path, tmp_path / "run", "--by", "nothing")


def test_replays_have_a_value_for_each_action(page):
    assert {replay["run"] for replay in page.data["replays"]} == {"dfs0", "learned"}  # the first of each group
    for replayed in page.data["replays"]:
        assert len(replayed["episodes"]) == 3
        for one in replayed["episodes"]:
            assert len(one["controller"]["values"]) == len(one["actions"]) == len(one["views"]) - 1


def test_steps_per_goal_equal_an_evaluation(page, runs):
    from hierroom.agents.evaluation import evaluate

    agent = hierroom.load(runs / "runs" / "dfs0")
    expected = evaluate(agent.pair(20, seed=0), agent.turns(20, seed=0), 20)
    (row,) = [row for row in page.data["goals"] if row["run"] == "dfs0"]
    assert row["success"] == expected.success_rate
    assert {goal["name"]: goal["share"] for goal in row["goals"]} == {
        name: steps.fraction for name, steps in expected.steps_to_goals.items()
    }


def test_training_goals_are_binned_by_steps(tmp_path):
    folder = RunFolder.create(tmp_path / "run", hierroom.TrainConfig())
    goals = ["[]", '["key 1"]', '["key 1", "coin"]', '["key 1", "coin", "key 1 > coin", 7]'] * 200  # as in a task
    columns = {"env": 0, "graph": "a", "success": 0, "length": 5, "return": 0.0}
    folder.episodes.append([{"steps": 10 * n, **columns, "goals": goal} for n, goal in enumerate(goals)])
    found = training_goals(folder)
    assert found["steps"][:2] == [95, 295]  # 40 bins of 20 episodes
    assert found["shares"] == [("coin", [0.5] * 40), ("key 1", [0.75] * 40), ("key 1 > coin", [0.25] * 40)]
    few = RunFolder.create(tmp_path / "few", hierroom.TrainConfig())
    few.episodes.append([{"steps": n, **columns, "goals": '["key 1"]' if n > 10 else "[]"} for n in range(25)])
    assert training_goals(few)["shares"] == [("key 1", [0.15385, 1])]
    assert training_goals(RunFolder(tmp_path / "none")) is None
    few.episodes.path.write_text("steps,graph\n1,a\n")
    with pytest.raises(InputError, match=r"episodes\.csv is broken: 'goals'"):
        training_goals(few)


def test_hostile_run_is_escaped_as_text(tmp_path, capsys):
    page = report(tmp_path, hostile_run(tmp_path))
    tags = [tag for tag, _ in page.elements]
    assert tags.count("script") == 4
    assert not {"img", "b"} & set(tags)
    assert not [names for _, names in page.elements if any(name.startswith("on") for name in names)]
    assert HOSTILE in page.text
    assert "</script><script>alert(2)</script>" in page.text
    assert "</dd></dl><script>alert(4)</script>" in page.text
    assert "<script>alert" not in page.source
    assert page.data["runs"][0]["name"] == HOSTILE
    assert "{{7*7}}" in page.text  # texts of runs are not templates


def test_note_about_hostile_folder_is_one_safe_line(tmp_path, capsys):
    make_run(tmp_path / "\x1b[31m\n", {"a": line(1.0)}, steps=[0])
    report(tmp_path, tmp_path)
    printed = capsys.readouterr().out
    assert "\x1b" not in printed
    assert r"\x1b[31m\n was evaluated only once so far: it has no learning curve" in printed


def test_script_json_cannot_close_the_script():
    value = {"</script>": ["<!--", "\u2028\u2029&amp;", float("nan"), float("inf")]}
    text = script_json(value)
    assert not set("<>&\u2028\u2029") & set(text)
    assert json.loads(text) == {"</script>": ["<!--", "\u2028\u2029&amp;", None, None]}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give the folders of the runs"),
        (["{run}", "--out", "report.pdf"], "a report is an .html file, not report.pdf"),
        (["{run}", "--out", "no/report.html"], "cannot write no/report.html: there is no folder no"),
        (["{run}", "--episodes", "0"], "episodes must be at least 1, not 0"),
        (["{run}", "--by", "gama"], "is it gamma?"),
        (["{run}", "--replays", "0", "--greedy"], "--greedy goes with --replays, which is 0"),
    ],
)
def test_invalid_report_options_raise_input_error(arguments, message, runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = [argument.replace("{run}", str(runs / "runs" / "dfs0")) for argument in arguments]
    with pytest.raises(InputError, match=re.escape(message)):
        main(given)
    assert list(tmp_path.iterdir()) == []


def test_a_broken_run_among_others_is_left_out(runs, tmp_path, capsys):
    bad = tmp_path / "bad"
    bad.mkdir()
    (bad / "config.json").write_text("{")
    deep = make_run(tmp_path / "deep", {"a": line(1.0)})
    (deep / "provenance.json").write_text("[" * 100_000 + "]" * 100_000)
    page = report(tmp_path, bad, deep, runs / "runs" / "dfs0", "--replays", 0)
    for path in (bad / "config.json", deep / "provenance.json"):
        assert f"left out: cannot read {path}: " in page.text
    with pytest.raises(InputError, match="cannot read"):
        main([str(bad), "--out", str(tmp_path / "b.html")])


def test_user_code_is_not_run_without_trust(tmp_path, capsys):
    make_run(tmp_path / "run", {"a": line(1.0)}, meta="os:abort")
    page = report(tmp_path, tmp_path / "run")
    assert "names code that does not ship with hierroom: meta 'os:abort'" in page.text
