"""Sweeps: what is planned, what is recognised, what is made again, and what becomes of killed processes."""

import csv
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from hierroom.errors import InputError
from hierroom.files import to_json, write_atomically
from hierroom.sweep.__main__ import SweepArguments
from hierroom.sweep.plan import RESULTS_VERSION, Plan, read_plan
from hierroom.sweep.summary import summarise
from hierroom.sweep.sweep import Shard, Sweep
from hierroom.sweep.table import SweepTable
from hierroom.training.config import TrainConfig
from hierroom.training.run_folder import RunFolder
from hierroom.training.session import resume

TINY = ("num_envs=4", "steps=300", "sequence_length=16", "sequences_per_update=4", "evaluations=2", "size=11")
TIMES = ("seconds", "steps_per_second")


def plan(*words: str, **settings) -> Plan:
    return Plan(**{**vars(read_plan(None, (*TINY, "max_steps=40", *words))), "episodes": 4, **settings})


def results(path: Path) -> list[dict[str, str]]:
    """The rows but for what tells the time, in one order."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    kept = [{k: v for k, v in row.items() if not k.startswith(TIMES)} for row in rows]
    return sorted(kept, key=lambda row: row["digest"])


def test_every_combination_is_planned_once_with_seeds_outermost():
    runs = plan("method=hippo,ppo", "gamma=0.9,0.99", graphs=("c", "rooms:2"), seeds=2).runs()
    told = [(r.config.seed, r.config.env.graph, r.config.agents.method, r.config.ppo.gamma) for r in runs]
    assert len(told) == len(set(map(str, told))) == 2 * 2 * 2 * 2
    assert [seed for seed, *_ in told] == [0] * 8 + [1] * 8
    assert runs[0].identity["graph"] == "c"
    assert runs[0].identity["gamma"] == "0.9"
    assert {run.config.threads for run in runs} == {1}
    assert len({run.name for run in runs}) == len(runs)


def test_a_file_and_words_make_a_plan(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text(
        'method = ["hippo", "ppo"]\nsteps = 1000\nseeds = 3\nfeatures = [["view", "goal"]]\n'
        "meta_ppo.gamma = [0.5, 0.6]\n"
        '[[variants]]\nname = "small"\nsize = 11\n[[variants]]\nname = "wide"\npreset = "large"\nsize = 31\n'
    )
    read = SweepArguments(what=(str(path), "steps=2_000", "meta=none,oracle"), seeds=1).plan()
    runs = read.runs()
    assert len(runs) == 2 * 2 * 2 * 2
    assert {run.config.steps for run in runs} == {2000}
    assert {run.config.agents.features for run in runs} == {("view", "goal")}
    assert {run.config.meta_ppo.gamma for run in runs} == {0.5, 0.6}
    assert {(run.identity["variant"], run.config.preset, run.config.env.size) for run in runs} == {
        ("small", "default", 11),
        ("wide", "large", 31),
    }


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("gama=0.9",), "there is no entry 'gama'; is it gamma?"),
        (("gamma",), "a sweep takes entry=value,value,... such as method=hippo,ppo, not 'gamma'"),
        (("gamma=",), "a sweep takes entry=value"),
        (("gamma=high",), "gamma must be a number, not 'high'"),
        (("steps=0",), "steps must be at least 1, not 0"),
        (("method=[]",), "method needs at least one value"),
        (("seed=1,1",), "two runs of the sweep are the same"),
        (("method=dqn",), "method must be one of"),
    ],
)
def test_what_cannot_be_planned_is_said_in_one_line(words, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        plan(*words).runs()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("steps = ", "is not a TOML file"),
        ("stepps = 3", "there is no entry 'stepps'; is it steps?"),
        ("seeds = 'many'", "seeds must be a whole number, not 'many'"),
        ("[[variants]]\ngamma = 1.0", "needs a name"),
        ("[[variants]]\nname = 'a'\n[[variants]]\nname = 'a'", "two variants have the same name"),
    ],
)
def test_what_a_file_holds_wrongly_is_said_with_its_path(tmp_path, text, message):
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        read_plan(path)
    assert str(path) in str(error.value)


def test_shards_are_all_runs_each_once():
    runs = plan("gamma=0.9,0.95,0.99", seeds=3).runs()
    parts = [Shard.parse(f"{n}/4").of(runs) for n in range(1, 5)]
    assert sorted(run.digest for part in parts for run in part) == sorted(run.digest for run in runs)
    for wrong in ("0/3", "4/3", "3", "a/b", "1/-2"):
        with pytest.raises(InputError, match="a shard is NUMBER/COUNT"):
            Shard.parse(wrong)


def test_the_digest_knows_what_decides_a_row_and_nothing_else():
    (one,), (other,) = plan("seed=0").runs(), plan("seed=0", "threads=2").runs()
    assert one.digest == other.digest, "threads decide nothing"
    changes = (("gamma=0.5",), ("seed=1",), ("steps=301",), ("evaluations=3",), ("meta_ppo.gamma=0.5",))
    digests = {plan("seed=0", *change).runs()[0].digest for change in changes}
    digests |= {plan("seed=0", episodes=5).runs()[0].digest, plan("seed=0", metas=("random",)).runs()[0].digest}
    assert len({one.digest, *digests}) == len(changes) + 3


def test_the_digest_of_a_run_that_excludes_graphs_is_not_that_of_before_these_were_evaluated(monkeypatch):
    decided = []
    monkeypatch.setattr("hierroom.sweep.plan.to_json", lambda decides: decided.append(decides) or to_json(decides))
    for words in ((), ("exclude=b",)):
        plan("seed=0", "graph=rooms:3", *words).runs()
    assert [len(decides) for decides in decided] == [4, 5]


def test_a_row_of_an_older_preset_is_made_again_and_others_stay(tmp_path):
    table = SweepTable(tmp_path)
    (old,), (new,) = plan("gamma=0.9", "seed=0").runs(), plan("gamma=0.8", "seed=0").runs()
    (other,) = plan("gamma=0.9", "seed=1").runs()
    for run in (old, other):
        table.add(run, {"success_rate": 0.123456789, "length": 40.0, "steps_to_95": float("inf")})
    assert [row["success_rate"] for row in table.of((old, other))] == ["0.123457"] * 2
    assert table.of((new,)) == []
    table.add(new, {"success_rate": 1.0, "more": 'it, "quoted"'})
    assert [row["digest"] for row in table.read()] == [other.digest, new.digest]
    assert [row["more"] for row in table.read()] == ["", 'it, "quoted"']
    assert table.read()[0]["steps_to_95"] == ""


@pytest.mark.parametrize("n_written", [0, 1, 2])
@pytest.mark.parametrize("replaces", [False, True])
def test_a_row_is_never_without_its_learning_curve(tmp_path, monkeypatch, n_written, replaces):
    """A crash between the tables leaves a run without a row, which is done again, and each row with its curve."""
    table, points = SweepTable(tmp_path), [{"steps": "100", "graph": "c", "success_rate": "0.5"}]
    (old,), (new,) = plan("gamma=0.9", "seed=0").runs(), plan("gamma=0.8", f"seed={0 if replaces else 1}").runs()
    (other,) = plan("gamma=0.9", "seed=2").runs()
    table.add(old, {"success_rate": 0.5}, points)
    left = iter(range(n_written))

    def write_then_crash(path, content):
        if next(left, None) is None:
            raise KeyboardInterrupt
        write_atomically(path, content)

    with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr("hierroom.sweep.table.write_atomically", write_then_crash)
        table.add(new, {"success_rate": 0.5}, points)
    for run in (other, new):
        assert {row["digest"] for row in table.read()} <= table.curves().keys()
        table.add(run, {"success_rate": 0.5}, points)
    assert {row["digest"] for row in table.read()} == table.curves().keys()
    assert table.curves().keys() == {run.digest for run in (other, new, *([] if replaces else [old]))}
    assert {len(curve) for curve in table.curves().values()} == {1}


def test_a_table_of_something_else_is_refused(tmp_path):
    path = tmp_path / "sweep.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="is no table of a sweep"):
        SweepTable(tmp_path).read()


def test_a_summary_has_medians_and_their_spread():
    runs = plan("method=hippo,ppo", "gamma=0.9", seeds=3).runs()
    numbers = {"steps_to_50": "", "length": "40", "length_over_shortest": "1.5", "greedy_success_rate": "0.5"}
    found = {"hippo": ("0.5", "1200000"), "ppo": ("0.25", "")}
    rows = []
    for run in runs:
        success, to_95 = found[run.config.agents.method]
        steps = "900000" if run.config.seed == 1 and to_95 else to_95
        rows.append({**run.identity, **numbers, "success_rate": success, "steps_to_95": steps, "digest": run.digest})
    summary = summarise(runs, rows[:-1])
    assert "single" not in summary.caption()
    assert summary.markdown().splitlines() == [
        "| method | runs | steps to 50% | steps to 95% | success | length | / shortest | greedy |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        "| hippo | 3 | - | 1.20M (900k to 1.20M) | 50.0% | 40 | 1.50 | 50.0% |",
        "| ppo | 2 | - | - | 25.0% | 40 | 1.50 | 50.0% |",
    ]
    assert summary.table().row_count == 2


def test_a_single_run_has_the_interval_of_its_evaluations():
    (run,) = plan("seed=0").runs()
    numbers = {"steps_to_50": "10000", "steps_to_50_low": "9000", "steps_to_50_high": "12000", "success_rate": "0.6"}
    numbers |= {"steps_to_95": "200000", "steps_to_95_low": "190000", "steps_to_95_high": "", "success_low": "0.5"}
    numbers |= {"success_high": "0.7", "length": "40", "length_over_shortest": "", "greedy_success_rate": "0.2"}
    row = {**run.identity, **numbers, "digest": run.digest}
    summary = summarise([run], [row])
    assert summary.caption().endswith(
        "; of a single run, in square brackets the 95% interval that its evaluations leave"
    )
    line = summary.lines[0]
    assert line[-6:] == ("10k [9k, 12k]", "200k [190k, -]", "60.0% [50.0%, 70.0%]", "40", "-", "20.0%")


def test_a_sweep_trains_what_is_missing_and_each_folder_is_complete(tmp_path):
    sweep = Sweep(plan("method=hippo,ppo", seeds=1, metas=("random",)), tmp_path / "out")
    assert sweep.fill(processes=2, command="made so").failures == ()
    rows = sweep.rows()
    assert [row["method"] for row in rows] == ["hippo", "ppo"]
    for row, run in zip(rows, sweep.plan.runs(), strict=True):
        folder = RunFolder.open(tmp_path / "out" / "runs" / run.name)
        assert folder.config() == run.config
        assert int(row["steps"]) >= 300
        assert 0 <= float(row["random_success_rate"]) <= 1
        assert row["command"] == "made so"
        for name in ("summary.json", "learning_curve.png", "evaluations.csv", "provenance.json"):
            assert (folder.path / name).is_file()
    curves = sweep.table.curves()
    for row in rows:
        points = curves[row["digest"]]
        assert [point["steps"] for point in points][::2] == ["0", row["steps"]]
        assert {"success_rate", "length", "achieved_key_1", "steps_to_exit"} <= points[0].keys()
    before = (tmp_path / "out" / "sweep.csv").read_bytes()
    assert sweep.fill(processes=2).failures == ()
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == before, "there was nothing to do"
    more = Sweep(plan("method=hippo,ppo", seeds=2, metas=("random",)), tmp_path / "out")
    more.fill(processes=1)
    assert len(more.rows()) == 4


def test_graphs_that_are_excluded_are_evaluated_too(tmp_path):
    of_some = plan('graph=[["rooms:2", "rooms:3"]]', 'exclude=[["b", "c"]]', "method=hippo", "max_steps=500", seeds=1)
    sweep = Sweep(of_some, tmp_path / "out")
    assert sweep.fill(processes=1).failures == ()
    (row,), (run,) = sweep.rows(), of_some.runs()
    trainer, _ = resume(run.config, tmp_path / "out" / "runs" / run.name)
    told = trainer.evaluate(of_some.episodes, graph=["b", "c"])
    assert told.graphs.keys() == {"b", "c"}
    assert f"{told.length:.6g}" == row["excluded_length"] != row["length"]
    assert trainer.evaluate(of_some.episodes).graphs.keys().isdisjoint({"b", "c"})
    assert "excluded graphs" in summarise(of_some.runs(), [row]).headings
    assert "excluded graphs" not in summarise(plan("seed=0").runs(), []).headings


def test_a_run_that_fails_is_reported_and_the_rest_goes_on(tmp_path):
    sweep = Sweep(plan("meta=fixed-dfs,none", "seed=0"), tmp_path / "out")
    config = tmp_path / "out" / "runs" / sweep.plan.runs()[0].name / "config.json"
    config.parent.mkdir(parents=True)
    config.write_text("{}")
    (failure,) = sweep.fill(processes=1).failures
    assert failure[0].identity["meta"] == "fixed-dfs"
    assert failure[1].startswith("InputError: ")
    assert [row["meta"] for row in sweep.rows()] == ["none"]


@pytest.mark.parametrize(
    ("words", "metas", "message"),
    [
        (("meta=none,no_such_module:Meta",), (), "there is no module 'no_such_module'"),
        (("size=19,3",), (), "-size3-.* cannot be trained: size must be a whole number from 11 to 63, not 3"),
        ((), ("nobody",), "a meta-controller is one of .*, not 'nobody'"),
    ],
)
def test_what_no_run_can_use_is_refused_before_any_is_trained(tmp_path, words, metas, message):
    with pytest.raises(InputError, match=message):
        Sweep(plan(*words, seeds=1, metas=metas), tmp_path / "out").fill(processes=1)
    assert not (tmp_path / "out").exists()


def test_a_file_is_no_folder_of_a_sweep(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match=r"written to a folder; .*out is none"):
        Sweep(plan(), tmp_path / "out")


def start(out: Path) -> subprocess.Popen:
    words = [*TINY, "max_steps=40", "steps=3000", "method=hippo,ppo"]
    options = ["--seeds", "2", "--episodes", "4", "--processes", "2", "--out", str(out)]
    command = [sys.executable, "-m", "hierroom.sweep", *words, *options]
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def children(process: subprocess.Popen) -> list[int]:
    """The processes that train for a sweep."""
    path = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    pids = [int(pid) for pid in path.read_text().split()]
    return [pid for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def wait_for(condition, process: subprocess.Popen, seconds: float = 120) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end and process.poll() is None:
        if condition():
            return True
        time.sleep(0.05)
    return False


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> list[dict[str, str]]:
    out = tmp_path_factory.mktemp("undisturbed")
    assert start(out).wait(300) == 0
    return results(out / "sweep.csv")


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
def test_killed_workers_and_a_killed_sweep_leave_the_same_table(tmp_path, undisturbed):
    process = start(tmp_path)
    assert wait_for(lambda: [*tmp_path.glob("runs/*/metrics.csv")], process)
    os.kill(children(process)[0], signal.SIGKILL)
    assert wait_for((tmp_path / "sweep.csv").exists, process)
    os.killpg(process.pid, signal.SIGKILL)  # the workers with it
    assert process.wait(60) == -signal.SIGKILL
    assert start(tmp_path).wait(300) == 0
    assert results(tmp_path / "sweep.csv") == undisturbed


def test_a_sweep_that_is_stopped_says_how_to_go_on_and_does(tmp_path, undisturbed):
    process = start(tmp_path)
    assert wait_for(lambda: [*tmp_path.glob("runs/*/metrics.csv")], process)
    process.send_signal(signal.SIGTERM)
    told = process.communicate(timeout=120)[0].decode()
    assert process.returncode == 130
    assert "stopped and saved; go on with:\npython -m hierroom.sweep" in told
    assert start(tmp_path).wait(300) == 0
    assert results(tmp_path / "sweep.csv") == undisturbed


def test_a_plan_holds_configs_as_training_does():
    (run,) = plan("seed=0").runs()
    assert isinstance(run.config, TrainConfig)
    assert run.config.env.size == 11


def test_an_entry_that_is_new_leaves_digests_as_they_are_and_another_default_does_not():
    """If this fails: an entry with another default needs another RESULTS_VERSION; for a new entry renew the text."""
    defaults = json.dumps(json.loads(to_json(TrainConfig(threads=1).to_dict())), sort_keys=True)
    assert (RESULTS_VERSION, hashlib.sha256(defaults.encode()).hexdigest()[:16]) == (1, "d1bed226f5e7516e")
    (run,) = plan("seed=0", "stagger_clocks=true").runs()
    assert run.digest == plan("seed=0").runs()[0].digest
    assert run.digest != plan("seed=0", "stagger_clocks=false").runs()[0].digest
