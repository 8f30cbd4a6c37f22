"""Sweeps: the runs that they train, failures and refusals."""

import json
import multiprocessing
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from tiny_sweep import plan

from hierroom.commands.sweep import main
from hierroom.lab.sweep import job, pool
from hierroom.lab.sweep.job import Event, Job
from hierroom.lab.sweep.plan import Plan, read_plan
from hierroom.lab.sweep.summary import summarise
from hierroom.lab.sweep.sweep import Sweep
from hierroom.runs.folder.provenance import variant_of
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.run_lock import RunLockedError
from hierroom.runs.session import begin, resume
from hierroom.support.errors import InputError


@pytest.mark.slow
def test_sweep_trains_missing_runs_completely(tmp_path):
    sweep = Sweep(plan("method=hippo,ppo", seeds=1, metas=("random",)), tmp_path / "out")
    assert sweep.fill(processes=2, command="made so").failures == ()
    rows = sweep.rows().to_dict("records")
    assert [row["method"] for row in rows] == ["hippo", "ppo"]
    assert [bool(row["random_success_rate"]) for row in rows] == [True, False], "ppo sees no goals"
    for row, run in zip(rows, sweep.plan.runs(), strict=True):
        folder = RunFolder.open(tmp_path / "out" / "runs" / run.name)
        assert folder.config() == run.config
        assert int(row["steps"]) >= 300
        assert 0 <= float(row["random_success_rate"] or 0) <= 1
        assert row["command"] == "made so"
        for name in ("summary.json", "learning_curve.png", "evaluations.csv", "provenance.json"):
            assert (folder.path / name).is_file()
        (session,) = json.loads((folder.path / "provenance.json").read_text())["sessions"]
        assert session["command"] == shlex.join(sys.orig_argv)
        assert "variant" not in session
    curves = sweep.table.curves()
    for row in rows:
        points = curves[row["digest"]]
        assert [*points["steps"]][::2] == [0, int(row["steps"])]
        assert {"success_rate", "length", "achieved_key_1", "steps_to_exit"} <= {*points}
    before = (tmp_path / "out" / "sweep.csv").read_bytes()
    assert sweep.fill(processes=2).failures == ()
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == before, "no run was missing"
    more = Sweep(plan("method=hippo,ppo", seeds=2, metas=("random",)), tmp_path / "out")
    more.fill(processes=1)
    assert len(more.rows()) == 4


@pytest.mark.slow
def test_excluded_graphs_are_evaluated(tmp_path):
    of_some = plan('graph=[["rooms:2", "rooms:3"]]', 'exclude=[["b", "c"]]', "method=hippo", "max_steps=500", seeds=1)
    sweep = Sweep(of_some, tmp_path / "out")
    assert sweep.fill(processes=1).failures == ()
    rows, (run,) = sweep.rows(), of_some.runs()
    trainer, _ = resume(run.config, tmp_path / "out" / "runs" / run.name)
    output = trainer.evaluate(of_some.episodes, graph=["b", "c"])
    assert output.graphs.keys() == {"b", "c"}
    assert f"{output.length:.6g}" == rows["excluded_length"][0] != rows["length"][0]
    assert trainer.evaluate(of_some.episodes).graphs.keys().isdisjoint({"b", "c"})
    assert "excluded graphs" in summarise(of_some.runs(), rows).headings
    assert "excluded graphs" not in summarise(plan("seed=0").runs(), rows[:0]).headings


@pytest.mark.slow
def test_failed_run_is_reported_and_others_continue(tmp_path):
    sweep = Sweep(plan("meta=fixed-dfs,none", "seed=0"), tmp_path / "out")
    config = tmp_path / "out" / "runs" / sweep.plan.runs()[0].name / "config.json"
    config.parent.mkdir(parents=True)
    config.write_text("{}")
    (failure,) = sweep.fill(processes=1).failures
    assert failure[0].identity["meta"] == "fixed-dfs"
    assert failure[1].startswith(str(config))
    assert [*sweep.rows()["meta"]] == ["none"]


@pytest.mark.slow
def test_sweep_trains_a_task_in_several_processes(tmp_path, capfd):
    words = ("task=chest_task:split", "num_envs=4", "steps=64", "sequence_length=16", "evaluations=0", "seed=0")
    sweep = Sweep(Plan(read_plan(None, words).values, episodes=4), tmp_path / "out")
    assert sweep.fill(processes=1).failures == ()
    assert len(sweep.rows()) == 1
    assert "Traceback" not in capfd.readouterr().err, "the processes of the task end quietly"


@pytest.mark.slow
def test_run_of_another_version_fails_with_advice(tmp_path):
    sweep = Sweep(plan("seed=0"), tmp_path / "out")
    (run,) = sweep.plan.runs()
    folder = RunFolder.create(tmp_path / "out" / "runs" / run.name, run.config)
    (folder.checkpoints / "000000000100.pt").write_bytes(b"of another format")
    ((_, output),) = sweep.fill(processes=1).failures
    assert "has no digest at its end" in output
    assert output.endswith(f"; move {folder.path} away to train this run from its beginning")
    folder.path.rename(tmp_path / "away")
    assert sweep.fill(processes=1).failures == ()


@pytest.mark.parametrize(
    ("words", "metas", "message"),
    [
        (("meta=none,no_such_module:Meta",), (), "there is no module 'no_such_module'"),
        (("size=19,3",), (), "-size3-.* cannot be trained: size must be a whole number from 11 to 63, not 3"),
        ((), ("nobody",), "a meta-controller is one of .*, not 'nobody'"),
    ],
)
def test_invalid_entries_raise_input_error_before_training(tmp_path, words, metas, message):
    with pytest.raises(InputError, match=message):
        Sweep(plan(*words, seeds=1, metas=metas), tmp_path / "out").fill(processes=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "steps", "length", "played"),
    [
        (7, 8_000, 1000.0, [7]),
        (None, 8_000, 1000.0, [100]),  # the least number, for any number of steps
        (None, 800_000, 260.0, [100, 300]),  # 384 episodes take an eighth of the steps, and there are two evaluations
        (None, 8_000_000, 50.0, [100, 1000]),
    ],
)
def test_final_evaluations_take_at_most_a_quarter_of_steps(given, steps, length, played):
    asked = []

    def evaluate(episodes, **kind):
        asked.append((episodes, kind))
        return SimpleNamespace(episodes=episodes, length=length)

    work = job.Job(None, Path("run"), given, (), "")
    trainer = SimpleNamespace(evaluate=evaluate, config=SimpleNamespace(evaluation_steps=None))
    assert work._evaluate(trainer, steps / 4 / 2, {"is_greedy": True}).episodes == played[-1]
    assert asked == [(episodes, {"is_greedy": True}) for episodes in played]


def test_run_killed_before_its_provenance_keeps_its_variant(tmp_path):
    (run,) = plan("seed=0", "steps=64", "evaluations=0", variants={"mine": {}}).runs()
    folder = RunFolder.create(tmp_path / "run", run.config)
    assert Job(run, folder.path, episodes=1, metas=(), command="").work(lambda steps, words: None) is not None
    assert variant_of(folder.path) == "mine"


def test_run_in_training_raises_run_locked_error(tmp_path):
    run = plan("method=ppo").runs()[0]
    folder = RunFolder.create(tmp_path / "run", run.config)
    with folder.lock, pytest.raises(RunLockedError, match="is being trained by another process"):
        job.Job(run, tmp_path / "run", 4, (), "").work(print)


def test_file_as_sweep_folder_raises_input_error(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match=r"written to a folder; .*out is none"):
        Sweep(plan(), tmp_path / "out")


def test_sweep_into_a_run_folder_raises_input_error(tmp_path):
    begin(plan().runs()[0].config, tmp_path / "run")[1].lock.release()
    before = sorted(path.name for path in (tmp_path / "run").iterdir())
    with pytest.raises(InputError, match=r"run is the folder of a single run; choose another --out$"):
        Sweep(plan(), tmp_path / "run")
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == before


def test_invalid_number_of_processes_raises_input_error(tmp_path):
    for processes in (0, -1, 1025):
        with pytest.raises(InputError, match=rf"processes must be at (least 1|most 1024), not {processes}$"):
            Sweep(plan("seed=0"), tmp_path / "s").fill(processes=processes)


def test_empty_shard_does_nothing(tmp_path, capsys):
    for option in ((), ("--list",), ("--markdown",)):
        assert main(["method=hippo", "graph=a", "--shard", "3/8", "--out", str(tmp_path / "out"), *option]) == 0
        assert capsys.readouterr().out == "shard 3/8 holds none of the 1 runs\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "say what to train: entries with values to try such as method=hippo,ppo, a TOML file"),
        (("/",), "/ is a folder; a sweep takes entries or a TOML file of them, and its folder as --out"),
        (("task=workshop:1", "--list"), "the number of goals of a workshop must be at least 2, not 1"),
        (("--task", "workshop:3"), "a sweep takes entries of training as words: task=workshop:3, not --task$"),
        (
            ("method=ppo", "--num-envs=8,16"),
            "takes entries of training as words: num_envs=8,16, not --num-envs$",
        ),
        (("graph=a", "--list", "--markdown"), "--list and --markdown print different things; choose one"),
        (("graph=a", "--ray", "auto", "--processes", "2"), "--processes is for this machine, and --ray trains on a"),
    ],
)
def test_invalid_command_lines_raise_input_error(words, message):
    with pytest.raises(InputError, match=message):
        main(words)


@pytest.mark.parametrize("words", [("meta=nosuch",), ("--metas", "nosuch"), ("--processes", "0"), ("num_envs=1",)])
def test_list_refuses_what_the_sweep_refuses(words, tmp_path):
    said = []
    for option in ((), ("--list",)):
        with pytest.raises(InputError) as refused:
            main(["graph=a", *words, *option, "--out", str(tmp_path / "out")])
        said.append(str(refused.value))
    assert said[0] == said[1]
    assert not (tmp_path / "out").exists()


def test_run_that_does_not_stop_is_unsaved(monkeypatch):
    monkeypatch.setattr(pool, "_SAVING_SECONDS", 0.05)
    process, connections, hanging = Mock(), multiprocessing.Pipe(), Mock()
    hanging.run.name = "a run"
    events = pool._stopped([pool._Worker(process, connections[0], hanging)])
    assert [*events] == [Event("unsaved", hanging)]
    process.terminate.assert_called_once_with()
