"""Runs of tasks without a target: what counts is the return, or the geometric mean over the goals where there are."""

import json
import math
import signal
from pathlib import Path
from types import SimpleNamespace

import chest_task
import numpy as np
import pandas as pd
import pytest
from same_run import differences
from stopped_run import stop_at_update

import hierroom
from hierroom.agents.evaluation import geometric_mean
from hierroom.agents.scripted_agent import WarmUp
from hierroom.commands import compare, evaluate, report, watch
from hierroom.lab.sweep.plan import read_plan
from hierroom.lab.sweep.summary import summarise
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError
from hierroom.train import main as train

SMALL = ["--num-envs", "4", "--sequence-length", "16", "--minibatches", "2", "--epochs", "1", "--hidden-size", "8"]
SMALL += ["--steps", "512", "--evaluations", "2", "--evaluation-episodes", "8", "--threads", "1", "--log", "none"]
AGENTS = {"balance": [], "camp": ["--meta", "learned"]}
"""Options by task: balance has no goals, camp has some and no target."""


def trained(task: str, folder: Path, code: int = 0) -> Path:
    out = folder / task
    assert train(["--task", f"chest_task:{task}", *SMALL, *AGENTS[task], "--out", str(out)]) == code
    return out


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("runs")
    return {task: trained(task, folder) for task in AGENTS}


def test_run_without_a_method_trains_ppo_and_reports_returns(runs):
    run = runs["balance"]
    assert RunFolder.open(run).config().agents.method == "ppo"
    rows = RunFolder.open(run).evaluations.read()
    assert [math.isnan(float(row["success_rate"])) for row in rows] == [True] * 3
    assert [row["return"] for row in rows] == [row["length"] for row in rows]  # each step is rewarded by 1
    summary = json.loads((run / "summary.json").read_text())
    assert (summary["steps_to_50"], summary["evaluated_success_rate"]) == (None, None)
    assert summary["evaluated_return"] == float(rows[-1]["return"])
    assert (run / "episode.gif").exists()


def test_score_is_crafters_geometric_mean():
    # (1 + 100) * (1 + 0) * (1 + 25) = 2626, the third root of which is 13.796372
    assert all(geometric_mean(np.ones(n)) == 1 for n in range(1, 64))  # tables refuse more
    assert geometric_mean([1, 0, 0.25]) == pytest.approx(0.12796372)


def test_tables_have_the_score_of_the_goals(runs):
    run = runs["camp"]
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


@pytest.mark.slow
@pytest.mark.parametrize("task", AGENTS)
def test_stopped_run_resumes_exactly(task, runs, tmp_path, monkeypatch):
    stop_at_update(monkeypatch, signal.SIGINT, 3)
    stopped = trained(task, tmp_path / "stopped", code=130)
    assert train(["--resume", str(stopped), "--trust-run", "--log", "none"]) == 0
    assert differences(runs[task], stopped) == []


@pytest.mark.parametrize(
    ("task", "outcomes", "said", "heading"),
    [
        ("balance", [], ["return of the controller on task chest_task:balance"], "return"),
        (
            "camp",
            ["chest"],
            ["score (geometric mean of the goals)", "score over all goals on task camp", "episodes with chest on task"],
            "score",
        ),
    ],
)
def test_commands_show_what_counts(task, outcomes, said, heading, runs, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = str(runs[task])
    assert evaluate.main([run, "--trust-run", "--episodes", "4"]) == 0
    for outcome in ([], *(["--outcome", one] for one in outcomes)):
        assert compare.main([run, "--resamples", "100", *outcome]) == 0
    assert report.main([run, "--trust-run", "--episodes", "1", "--played", "4"]) == 0
    printed = capsys.readouterr().out
    assert all(one in printed for one in said)
    assert "success" not in printed
    page = (tmp_path / "report.html").read_text()
    assert (f'<th scope="col" class="number">{heading}</th>' in page, "nan%" in page) == (True, False)
    assert f'"metrics":[{{"name":"{heading}"' in page.replace(" ", "")


def test_commands_refuse_outcomes_that_a_run_has_not(runs):
    with pytest.raises(InputError, match=r"^chest_task:balance has no target, so --failures"):
        watch.main([str(runs["balance"]), "--trust-run", "--failures"])
    with pytest.raises(InputError, match=r"--outcome is one of score, .* or a goal \(chest, coin, key\), not 'exit'"):
        compare.main([str(runs["camp"]), "--resamples", "100", "--outcome", "exit"])


@pytest.mark.parametrize(
    ("task", "score", "shown"), [("balance", "", ("return", "21.5")), ("camp", "0.25", ("score", "25.0%"))]
)
def test_summary_of_a_sweep_has_what_counts(task, score, shown):
    (planned,) = read_plan(None, [f"task=chest_task:{task}"]).runs()
    assert task == "camp" or planned.identity["method"] == "ppo"
    row = {"success_rate": "", "return": "21.5", "length": "21.5", "length_over_shortest": "", "score": score}
    summary = summarise([planned], pd.DataFrame([{**planned.identity, **row}]))
    assert shown in zip(summary.headings, summary.lines[0], strict=True)


@pytest.mark.parametrize("option", ["--method=hippo", "--method=ppo-bonus", "--meta=random"])
def test_methods_with_goals_are_refused(option, tmp_path):
    with pytest.raises(InputError, match=r"balance has (no goals to pick, so train|none; give it the reward)"):
        train(["--task", "chest_task:balance", *SMALL, option, "--out", str(tmp_path / "run")])


@pytest.mark.parametrize("task", [chest_task.balance, chest_task.two_balances], ids=["here", "processes"])
def test_episode_has_no_success_and_its_return(task):
    assert (task.goals, task.target, hierroom.env(task).unwrapped.complexity) == ({}, None, None)
    (episode,) = hierroom.rollout("random", hierroom.EnvConfig(task=task), episodes=1)
    assert (episode.success, episode.rewards.sum(), len(episode.events)) == (None, len(episode), 0)
    assert episode.title.endswith(f": return {len(episode)}, {len(episode)} steps")


@pytest.mark.slow
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
