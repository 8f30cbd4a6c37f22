"""Odd names of goals, graphs, features and variants: files give them back, or they are refused before any play."""

import json
from contextlib import suppress

import numpy as np
import pytest
from evaluated_runs import line, make_run
from hypothesis import example, given, settings
from hypothesis import strategies as st
from odd_names import ODD_NAMES, counter_task
from report_page import Page

import hierroom
from hierroom.agents.evaluation import Evaluation, GoalSteps, SuccessInterval
from hierroom.commands import report
from hierroom.goals import GoalGraph, Rules
from hierroom.goals.alternatives import toml_text
from hierroom.goals.goal_set import GoalSet
from hierroom.lab.compare.comparison import compare
from hierroom.lab.compare.evaluated_run import read_run
from hierroom.lab.compare.grouping import choose_groups
from hierroom.lab.compare.tasks import Tasks
from hierroom.lab.report.curves import training_goals
from hierroom.lab.sweep.plan import read_plan
from hierroom.lab.sweep.table import SweepTable
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.episode_log import EpisodeLog
from hierroom.runs.logs.learning_curve import MILESTONES, evaluation_rows
from hierroom.runs.logs.scalars import evaluation_scalars
from hierroom.support.errors import InputError
from hierroom.support.files import to_json

SEVERAL = st.lists(ODD_NAMES, min_size=1, max_size=6, unique=True)


def _usable(names, use):
    """The names with which ``use`` makes no InputError, each in addition to those before it."""
    taken = []
    for name in names:
        with suppress(InputError):
            use([*taken, name])
            taken.append(name)
    return taken


@settings(max_examples=25)
@given(SEVERAL)
@example(["two episodes", "success rate", "episode return", "length"])  # like columns with another range
@example(["a b", "a_b", "a  b", "new", "no goal", *map(str, MILESTONES)])
def test_tables_of_a_run_give_back_each_goal(tmp_path_factory, names):
    if not (names := _usable(names, counter_task)):
        return
    assert not {"new", "no goal", *map(str, MILESTONES)}.intersection(names)  # tables have these columns already
    folder = RunFolder.create(tmp_path_factory.mktemp("runs") / "run", hierroom.TrainConfig())
    goals = {name: GoalSteps(1 / (2 + n), 2.5 + n) for n, name in enumerate(names)}
    score = Evaluation(3, 0.5, SuccessInterval(0.1, 0.9), 9.0, np.nan, 0.0, np.nan, goals, graphs={})
    folder.evaluations.append(evaluation_rows(7, 1.0, Evaluation(**{**vars(score), "graphs": {"a": score}})))
    (row,) = RunFolder(folder.path).evaluations.read()
    own = [float(cell) for name, cell in row.items() if name.startswith(("achieved_", "steps_to_"))]
    assert own == [round(value, 6) for pair in goals.values() for value in pair]
    assert sum(tag.startswith("eval/achieved/") for tag in evaluation_scalars(score)) == len(names)
    assert len(EpisodeLog(GoalSet.one_hot(names, names[0]), np.zeros(2, int)).reached) == len(names) + 1


def test_report_tells_apart_goals_whose_names_join(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = {"num_envs": 4, "sequence_length": 8, "minibatches": 2, "hidden_size": 8, "steps": 256, "evaluations": 0}
    run = hierroom.train(task="odd_names:joined", threads=1, **small, out="run", log="none", quiet=True)
    found = training_goals(RunFolder(str(run.path)))
    assert found is not None
    assert [(name, {*shares}) for name, shares in found["shares"]] == [("a > b", {1})]  # and not a and b


def test_report_and_comparison_have_a_curve_for_each_graph(tmp_path):
    names = ["all", "own", "constructor", "__proto__", "10", "2, a"]
    rooms = [(0,), (0, 0), (0, 1), (0, 0, 1), (0, 0, 0), (0, 1, 2)]
    graphs = tuple(map(GoalGraph, rooms, [1] * 6, names))
    path = make_run(tmp_path / "run", {name: line(1 / (n + 1)) for n, name in enumerate(names)}, graph=graphs)
    groups = choose_groups([read_run(path)], None)
    compared = compare(groups, Tasks.common(groups), "success_rate", 2, 0)
    assert len(compared.summaries) == len(names) + 1
    assert report.main([str(path), "--replays", "0", "--out", str(tmp_path / "report.html")]) == 0
    data = Page(tmp_path / "report.html").data
    assert [one["name"] for one in data["runs"][0]["graphs"]] == names
    shown = {one["graph"]: one["values"][-1] for one in data["curves"] if one["metric"] == "success_rate"}
    assert shown.pop(None) is not None  # all together
    assert shown == {name: round(1 / (n + 1), 5) for n, name in enumerate(names)}
    assert {one["graph"] for one in data["points"]} == {one["graph"] for one in data["complexity"]} == {*names}


@settings(max_examples=10)
@given(SEVERAL, SEVERAL)
@example(["a b", "c"], ["a", "b c"])
def test_sweep_tables_give_back_variants_and_lists(tmp_path_factory, first, second):
    folder = tmp_path_factory.mktemp("sweep")
    lists = [[toml_text(name) for name in names if name.isprintable()] for names in (first, second)]
    if not all(lists) or lists[0] == lists[1]:
        return
    values = ", ".join(f"[{', '.join(names)}]" for names in lists)
    variants = dict.fromkeys(json.loads(name) for names in lists for name in names)
    named = [f"[[variants]]\nname = {toml_text(name)}\nsteps = {n + 9}\n" for n, name in enumerate(variants)]
    (file := folder / "plan.toml").write_text(
        f'task = "odd_names:counter"\nfeatures = [{values}]\n{"".join(named)}', encoding="utf-8"
    )
    runs, table = read_plan(file).runs(), SweepTable(folder)
    for n, run in enumerate(runs):
        table.add(run, {"success_rate": n / len(runs), "length": 1.0, "steps": 9})
    found = SweepTable(folder).of(runs)
    assert {*found["size"]} == {""}  # it means nothing for a task
    assert [*found["variant"]] == [name for name in variants for _ in range(2)]
    assert len({*zip(found["variant"], found["features"], strict=True)}) == len(runs)
    rates = [float(rate) for rate in found["success_rate"]]
    assert rates == pytest.approx([n / len(runs) for n in range(len(runs))], abs=1e-5)


@pytest.mark.parametrize(
    ("word", "values"),
    [
        ('warm_start="a,b",c', None),
        ("warm_start=[a", None),
        ('warm_start="a,b","c"', ["a,b", "c"]),
        ("warm_start='a,b'", ["a,b"]),
        ("warm_start=it's,c", ["it's", "c"]),
        ('features=[["a,b", "c"], ["a"]]', [("a,b", "c"), ("a",)]),
    ],
)
def test_quoted_values_of_a_sweep_keep_their_commas(word, values):
    if values is None:
        with pytest.raises(InputError, match=r"^values in quotes or brackets are TOML"):
            read_plan(None, [word])
    else:
        assert [*read_plan(None, [word]).values.values()] == [values]


@settings(max_examples=50)
@given(SEVERAL, ODD_NAMES)
def test_rules_and_graphs_are_read_as_they_were_written(tmp_path_factory, names, label):
    path = tmp_path_factory.mktemp("toml") / "own.toml"
    names = _usable(names, lambda all_of_them: Rules({name: {"gives": name} for name in all_of_them}, all_of_them[0]))
    if names:
        ways = {name: [{"needs": names[:n], "gives": name}, {"uses": {name: 2}}] for n, name in enumerate(names)}
        rules = Rules(ways, names[-1], dict.fromkeys(names, 3))
        rules.to_toml(path)
        assert Rules.from_toml(path) == Rules.from_dict(json.loads(json.dumps(rules.to_dict()))) == rules
    for name in _usable([label], lambda one: GoalGraph((0,), 1, *one)):
        graph = GoalGraph((0,), 1, name)
        graph.to_toml(path)
        config = hierroom.TrainConfig().changed(graph=[graph, "c"])
        assert hierroom.TrainConfig.from_dict(json.loads(to_json(config.to_dict()))).env.names == (name, "c")
        assert (
            GoalGraph.from_toml(path).name == GoalGraph.from_dict(json.loads(json.dumps(graph.to_dict()))).name == name
        )
