"""Searches with Optuna, over runs with curves of known shape."""

import math
import shlex
import sys
from types import SimpleNamespace

import pytest
from evaluated_runs import line, make_run, rows

from hierroom.commands.sweep import main
from hierroom.lab.sweep import search
from hierroom.lab.sweep.search import reference_of, scores_so_far
from hierroom.lab.sweep.sweep import Sweep, SweepOutcome
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.learning_curve import evaluation_points
from hierroom.support.errors import InputError
from hierroom.train import parse

WORDS = ("graph=a,b", "learning_rate=1e-5..1e-2", "minibatches=2,4", "evaluations=4")


def test_search_without_optuna_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(InputError, match=r"^--search needs Optuna: pip install 'hierroom\[search\]'$"):
        main([*WORDS, "--search", "3", "--out", str(tmp_path / "out")])


def test_score_is_mean_success_so_far(tmp_path):
    folders = [make_run(tmp_path / "half", {"a": line(1.0)})]
    folders += [make_run(tmp_path / "begun", {"a": line(1.0)}, [0, 200_000])]
    scores = scores_so_far(folders, [100_000, 500_000, 1_000_000], [*map(reference_of, folders)])
    assert scores == pytest.approx([0.005 / 2, 0.125 / 2, 0.5 / 2, (0.5 + 0.005) / 2])


def test_score_of_return_is_gain_over_the_first_trial(tmp_path):
    folders = []
    for name, returns in (("first", (-10, 30)), ("better", (0, 40)), ("worse", (-20, -40))):
        folder = RunFolder.create(tmp_path / name, TrainConfig())
        row = dict.fromkeys(("success_rate", "success_low", "success_high", "length_over_shortest"), math.nan)
        row |= {"seconds": 1, "graph": "cart", "episodes": 1, "length": 5}
        folder.evaluations.append([{"steps": 10 * n, **row, "return": one} for n, one in enumerate(returns)])
        folders.append(folder.path)
    reference = reference_of(folders[0])
    assert reference == (-10.0, 40.0)
    alone = [scores_so_far([folder], [10], [reference])[0] for folder in folders]
    assert alone == pytest.approx([20 / 60, 30 / 70, 0])


@pytest.fixture
def trained(monkeypatch):
    """Train nothing: the success of a run follows from its learning rate. Returns the seeds and graphs of each call."""
    pytest.importorskip("optuna")
    calls = []

    def fill(sweep, *, watch, **how):
        calls.append([(run.config.seed, run.config.env.names) for run in sweep.plan.runs()])
        if len(calls) == trained.stopped_call:
            return SweepOutcome((), (), True)
        for run in sweep.plan.runs():
            end = 1 - abs(math.log10(run.config.ppo.learning_rate) + 3) / 3
            if not (folder := sweep.out / "runs" / run.name).exists():
                make_run(folder, {"a": line(end)}, evaluation_points(1_000_000, 4))
            if watch(SimpleNamespace(kind="progressed")):
                break
        return SweepOutcome((), (), False)

    trained = SimpleNamespace(calls=calls, stopped_call=0)
    monkeypatch.setattr(Sweep, "fill", fill)
    monkeypatch.setattr(search, "_SECONDS", 0.0)
    return trained


@pytest.mark.slow
def test_stopped_search_goes_on_as_if_it_had_not(trained, tmp_path, capsys):
    assert main([*WORDS, "--search", "9", "--out", str(tmp_path / "whole")]) == 0
    output = capsys.readouterr()
    assert trained.calls == [[(10**6, ("a",)), (10**6, ("b",))]] * 9
    trials = rows(tmp_path / "whole" / "trials.csv")
    assert float(trials[0]["score"]) == 0.5, "the first has the preset's learning rate, 0.001, and so the highest curve"
    assert {trial["state"] for trial in trials} == {"complete", "pruned"}
    assert "9 of 9 trials are done" in output.err
    words = shlex.split(output.out.splitlines()[-1])
    assert words[:5] == ["python", "-m", "hierroom", "train", "--graph"]
    assert parse(words[4:]).config.ppo.learning_rate == 0.001
    trained.stopped_call = len(trained.calls) + 4
    part = [*WORDS, "--out", str(tmp_path / "part"), "--search"]
    assert [main([*part, "9"]), main([*part, "7"]), main([*part, "9"])] == [130, 0, 0]
    assert (tmp_path / "part" / "trials.csv").read_bytes() == (tmp_path / "whole" / "trials.csv").read_bytes()
    with pytest.raises(InputError, match=r"has a search of other tasks, entries or ranges; choose another --out$"):
        main([*part, "9", "steps=2_000_000"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("gamma=0.9",), "say what to search: entries with a range"),
        (("gamma=0.9..0.99", "seed=3"), "a search has seeds from 1000000 on"),
        (("gamma=0.99..0.9",), r"gamma must be a number .*, not '0\.99\.\.0\.9'"),
        (("gamma=0.9..0.99", "--shard", "1/2"), "leave out --list, --markdown and --shard"),
        (("gamma=0.9..0.99", "evaluations=0"), "evaluations must be at least 1, not 0"),
        (("gamma=0.9..0.99", "size=3"), "size must be a whole number from 11 to 63, not 3"),
    ],
)
def test_invalid_searches_raise_input_error(words, message, trained, tmp_path):
    with pytest.raises(InputError, match=message):
        main(["graph=a", *words, "--search", "3", "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()
