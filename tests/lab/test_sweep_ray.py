"""A sweep on a Ray cluster of two nodes; one is killed in the middle. Needs Ray."""

import errno
import os
import sys
import threading
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from tiny_sweep import plan, results

from hierroom.lab.sweep.cluster import _pack, _unpack, work_on_cluster
from hierroom.lab.sweep.sweep import Sweep
from hierroom.support.errors import InputError

pytestmark = pytest.mark.slow


def test_missing_ray_raises_input_error(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match="--ray needs Ray: pip install 'hierroom\\[ray\\]'"):
        Sweep(plan("seed=0"), tmp_path).fill(ray="auto")


def test_unpacked_folder_replaces_a_partial_one(tmp_path, monkeypatch):
    whole, part = tmp_path / "whole", tmp_path / "runs" / "run"
    for folder, names in ((whole, ("config.json", "evaluations.csv")), (part, ("config.json", "metrics.csv"))):
        folder.mkdir(parents=True)
        for name in names:
            (folder / name).write_text(folder.name)
    content = _pack(whole)
    rename = Path.rename

    def fail(path, target):
        if path.name == "whole":
            raise OSError(errno.EIO, "Input/output error")
        return rename(path, target)

    for half, error in ((2, EOFError), (1, OSError)):
        with monkeypatch.context() as patch:
            patch.setattr(Path, "rename", fail)
            with pytest.raises(error):
                _unpack(content[: len(content) // half], part)
        assert {p.name: p.read_text() for p in part.iterdir()} == dict.fromkeys(["config.json", "metrics.csv"], "run")
    _unpack(content, part)
    assert {p.name: p.read_text() for p in part.iterdir()} == dict.fromkeys(["config.json", "evaluations.csv"], "whole")
    assert [path.name for path in part.parent.iterdir()] == ["run"]


def test_unpack_error_fails_only_its_run(tmp_path, monkeypatch):
    link = tmp_path / "link" / "x"
    link.parent.mkdir()
    link.symlink_to("/etc/passwd")
    (tmp_path / "plain").mkdir()
    contents = iter([_pack(link.parent), _pack(tmp_path / "plain")])
    ray = ModuleType("ray")
    ray.init = ray.shutdown = lambda **settings: None
    ray.remote = lambda **settings: lambda work: SimpleNamespace(remote=lambda job: object())
    ray.wait = lambda references, timeout: (references[:1], references[1:])
    ray.get = lambda reference: ({}, next(contents))
    monkeypatch.setitem(sys.modules, "ray", ray)
    run = SimpleNamespace(config=SimpleNamespace(steps=1))
    jobs = [SimpleNamespace(folder=tmp_path / "out" / name, run=run, check_folder=list) for name in ("one", "two")]
    events = [*work_on_cluster(jobs, "auto", SimpleNamespace(is_requested=False))]
    assert [(event.kind, event.job) for event in events] == [
        ("failed", jobs[0]),
        ("progressed", jobs[1]),
        ("finished", jobs[1]),
    ]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["two"]


@pytest.fixture
def cluster():
    pytest.importorskip("ray", reason="the extra ray is not installed")
    from ray.cluster_utils import Cluster

    os.environ["RAY_ENABLE_UV_RUN_RUNTIME_ENV"] = "0"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield cluster
    cluster.shutdown()


def test_missing_cluster_raises_input_error(tmp_path):
    pytest.importorskip("ray", reason="the extra ray is not installed")
    with pytest.raises(InputError, match=r"there is no Ray cluster at '127\.0\.0\.1:1'"):
        Sweep(plan("seed=0"), tmp_path).fill(ray="127.0.0.1:1")


def test_killed_node_loses_no_runs(tmp_path, cluster):
    doomed = cluster.add_node(num_cpus=1)
    settings = ("method=hippo,ppo", "steps=20000")
    elsewhere = Sweep(plan(*settings, seeds=2), tmp_path / "cluster")

    rows_before = []

    def kill():
        end = time.monotonic() + 120
        while not elsewhere.table.path.exists() and time.monotonic() < end:
            time.sleep(0.1)
        rows_before.extend(elsewhere.rows()["digest"])
        cluster.remove_node(doomed, allow_graceful=False)

    killer = threading.Thread(target=kill)
    killer.start()
    outcome = elsewhere.fill(ray=cluster.address)
    killer.join()
    assert outcome.failures == ()
    assert 1 <= len(rows_before) < len(elsewhere.plan.runs()), "runs were at work on both nodes"
    here = Sweep(elsewhere.plan, tmp_path / "here")
    here.fill(processes=2)
    assert results(elsewhere.table.path) == results(here.table.path)
    for run in elsewhere.plan.runs():
        for name in ("config.json", "summary.json", "evaluations.csv", "checkpoints"):
            assert (elsewhere.out / "runs" / run.name / name).exists()
