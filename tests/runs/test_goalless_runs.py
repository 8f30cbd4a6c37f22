"""Runs of a task without goals: flat, with the return as the outcome."""

import json
import math

import chest_task
import pandas as pd
import pytest
from untargeted_runs import SMALL, trained

import hierroom
from hierroom.commands import compare, evaluate, report, watch
from hierroom.lab.sweep.plan import read_plan
from hierroom.lab.sweep.summary import summarise
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError
from hierroom.train import main as train


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return trained("balance", tmp_path_factory.mktemp("runs"))


def test_run_without_a_method_trains_ppo_and_reports_returns(run):
    assert RunFolder.open(run).config().agents.method == "ppo"
    rows = RunFolder.open(run).evaluations.read()
    assert [math.isnan(float(row["success_rate"])) for row in rows] == [True] * 3
    assert [row["return"] for row in rows] == [row["length"] for row in rows]  # each step is rewarded by 1
    summary = json.loads((run / "summary.json").read_text())
    assert (summary["steps_to_50"], summary["evaluated_success_rate"]) == (None, None)
    assert summary["evaluated_return"] == float(rows[-1]["return"])
    assert (run / "episode.gif").exists()


def test_commands_show_the_return(run, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert evaluate.main([str(run), "--trust-run", "--episodes", "4"]) == 0
    assert compare.main([str(run), "--resamples", "100"]) == 0
    assert report.main([str(run), "--trust-run", "--episodes", "1", "--played", "4"]) == 0
    said = capsys.readouterr().out
    assert "return of the controller on task chest_task:balance" in said
    assert "success" not in said
    page = (tmp_path / "report.html").read_text()
    assert ('<th scope="col" class="number">return</th>' in page, "nan%" in page) == (True, False)
    assert '"metrics":[{"name":"return"' in page.replace(" ", "")
    with pytest.raises(InputError, match=r"^chest_task:balance has no target, so --failures"):
        watch.main([str(run), "--trust-run", "--failures"])


def test_sweep_plans_ppo_and_its_summary_has_the_return():
    (planned,) = read_plan(None, ["task=chest_task:balance"]).runs()
    assert planned.identity["method"] == "ppo"
    row = {"success_rate": "", "return": "21.5", "length": "21.5", "length_over_shortest": ""}
    summary = summarise([planned], pd.DataFrame([{**planned.identity, **row}]))
    assert dict(zip(summary.headings, summary.lines[0], strict=True))["return"] == "21.5"


@pytest.mark.parametrize("option", ["--method=hippo", "--method=ppo-bonus", "--meta=random"])
def test_methods_with_goals_are_refused(option, tmp_path):
    with pytest.raises(
        InputError, match=r"chest_task:balance has (no goals to pick, so train|none; give it the reward)"
    ):
        train(["--task", "chest_task:balance", *SMALL, option, "--out", str(tmp_path / "run")])


@pytest.mark.parametrize("task", [chest_task.balance, chest_task.two_balances], ids=["here", "processes"])
def test_episode_has_no_success_and_its_return(task):
    assert (task.goals, task.target, hierroom.env(task).unwrapped.complexity) == ({}, None, None)
    (episode,) = hierroom.rollout("random", hierroom.EnvConfig(task=task), episodes=1)
    assert (episode.success, episode.rewards.sum(), len(episode.events)) == (None, len(episode), 0)
    assert episode.title.endswith(f": return {len(episode)}, {len(episode)} steps")
