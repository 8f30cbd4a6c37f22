"""Runs of a task with goals and without a target: what counts is the geometric mean over the goals."""

import json
import math
import signal
from types import SimpleNamespace

import chest_task
import numpy as np
import pandas as pd
import pytest
from same_run import differences
from stopped_run import stop_at_update
from untargeted_runs import AGENTS, SMALL, trained

import hierroom
from hierroom.agents.evaluation import geometric_mean
from hierroom.agents.scripted_agent import WarmUp
from hierroom.commands import compare, evaluate, report
from hierroom.lab.sweep.plan import read_plan
from hierroom.lab.sweep.summary import summarise
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError
from hierroom.train import main as train


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return trained("camp", tmp_path_factory.mktemp("runs"))


def test_score_is_crafters_geometric_mean():
    # (1 + 100) * (1 + 0) * (1 + 25) = 2626, the third root of which is 13.796372
    assert all(geometric_mean(np.ones(n)) == 1 for n in range(1, 64))  # tables refuse more
    assert geometric_mean([1, 0, 0.25]) == pytest.approx(0.12796372)


def test_tables_have_the_score_of_the_goals(run):
    rows = RunFolder.open(run).evaluations.read()
    for row in rows:
        shares = [float(row[f"achieved_{goal}"]) for goal in ("coin", "key", "chest")]
        assert float(row["score"]) == pytest.approx(geometric_mean(shares), abs=1e-5)
        assert math.isnan(float(row["success_rate"]))
    summary, window = json.loads((run / "summary.json").read_text()), RunFolder.open(run).metrics.numbers()[-1]
    assert summary["evaluated_score"] == pytest.approx(float(rows[-1]["score"]), abs=1e-5)
    goals = [set(json.loads(row["goals"])) for row in RunFolder.open(run).episodes.read()]
    shares = [np.mean([goal in one for one in goals]) for goal in ("coin", "key", "chest")]
    assert window["score"] == pytest.approx(geometric_mean(shares))


def test_warm_up_of_a_learned_meta_ends_with_options_that_reach_their_goals():
    warm_up, everywhere = WarmUp(0.03, has_target=False), np.ones(100, bool)
    warm_up.add(SimpleNamespace(reached=np.arange(100) < 3, option_ended=everywhere))
    assert warm_up.has_ended


@pytest.mark.parametrize("task", AGENTS)
def test_stopped_run_resumes_exactly(task, tmp_path, monkeypatch):
    whole = trained(task, tmp_path)
    stop_at_update(monkeypatch, signal.SIGINT, 3)
    stopped = trained(task, tmp_path / "stopped", code=130)
    assert train(["--resume", str(stopped), "--trust-run", "--log", "none"]) == 0
    assert differences(whole, stopped) == []


def test_commands_show_the_score_and_each_goal(run, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert evaluate.main([str(run), "--trust-run", "--episodes", "4"]) == 0
    assert compare.main([str(run), "--resamples", "100"]) == 0
    assert compare.main([str(run), "--resamples", "100", "--outcome", "chest"]) == 0
    assert report.main([str(run), "--trust-run", "--episodes", "1", "--played", "4"]) == 0
    said = capsys.readouterr().out
    assert "score (geometric mean of the goals)" in said
    assert "score over all goals on task camp" in said
    assert "episodes with chest on task camp" in said
    assert "success" not in said
    page = (tmp_path / "report.html").read_text()
    assert ('<th scope="col" class="number">score</th>' in page, "nan%" in page) == (True, False)
    with pytest.raises(InputError, match=r"--outcome is one of score, .* or a goal \(chest, coin, key\), not 'exit'"):
        compare.main([str(run), "--resamples", "100", "--outcome", "exit"])


def test_summary_of_a_sweep_has_the_score():
    (planned,) = read_plan(None, ["task=chest_task:camp"]).runs()
    row = {"success_rate": "", "return": "1", "length": "21.5", "length_over_shortest": "", "score": "0.25"}
    summary = summarise([planned], pd.DataFrame([{**planned.identity, **row}]))
    assert dict(zip(summary.headings, summary.lines[0], strict=True))["score"] == "25.0%"


@pytest.mark.parametrize("method", ["ppo", "ppo-bonus", "ppo-sketch"])
def test_every_method_trains(method, tmp_path):
    assert train(["--task", "chest_task:camp", *SMALL, "--method", method, "--out", str(tmp_path / "run")]) == 0


def test_episodes_end_with_the_environment_and_are_no_success():
    (episode,) = hierroom.rollout("random", hierroom.EnvConfig(task=chest_task.camp), episodes=1)
    assert episode.success is None
    env = hierroom.env(chest_task.camp).unwrapped
    assert {goal: one.fewest for goal, one in env.complexity.items()} == {"coin": 1, "key": 1, "chest": 2}


def test_fixed_dfs_pursues_the_deepest_goal_that_is_legal_and_missing():
    rules = {"wood": {}, "table": {"uses": {"wood": 1}}, "axe": {"needs": "table", "uses": {"wood": 1}}, "nap": {}}
    task = hierroom.Task(make=chest_task.Chest, goals=dict.fromkeys(rules, lambda env, info: 0), rules=rules)
    world = task.make_world(hierroom.EnvConfig(task=task), 5, seed=0)
    achieved = ([], ["wood"], ["wood", "nap", "table"], ["wood", "table", "wood"], ["nap"])
    for env, goals in enumerate(achieved):
        for goal in goals:
            times = np.zeros((5, 4), np.int64)
            times[env, [*rules].index(goal)] = 1
            world.record(times, np.zeros(5), np.zeros(5, bool))
    view, names = world.observe(world.everywhere), [*rules]
    chosen = [
        {names[goal] for goal in np.flatnonzero(row == row.max())}
        for row in np.where(view.reachable, view.depth_first_ranks, -1)
    ]
    # all at depth 1; the deeper one; wood again for the axe; the axe; the only one that is missing
    assert chosen == [{"wood", "nap"}, {"table"}, {"wood"}, {"axe"}, {"wood"}]
