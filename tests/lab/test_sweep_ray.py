"""A sweep on a Ray cluster of two nodes; one is killed in the middle. Needs Ray."""

import os
import sys
import threading
import time

import pytest
from tiny_sweep import plan, results

from hierroom.lab.sweep.cluster import _pack, _unpack
from hierroom.lab.sweep.sweep import Sweep
from hierroom.support.errors import InputError

pytestmark = pytest.mark.slow


def test_without_ray_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match="--ray needs Ray: pip install 'hierroom\\[ray\\]'"):
        Sweep(plan("seed=0"), tmp_path).fill(ray="auto")


def test_a_folder_that_comes_back_takes_the_place_of_a_part(tmp_path):
    whole, part = tmp_path / "whole", tmp_path / "runs" / "run"
    for folder, names in ((whole, ("config.json", "evaluations.csv")), (part, ("config.json", "metrics.csv"))):
        folder.mkdir(parents=True)
        for name in names:
            (folder / name).write_text(folder.name)
    content = _pack(whole)
    with pytest.raises(EOFError):
        _unpack(content[: len(content) // 2], part)
    assert {path.name: path.read_text() for path in part.iterdir()} == dict.fromkeys(
        ["config.json", "metrics.csv"], "run"
    )
    _unpack(content, part)
    assert {path.name: path.read_text() for path in part.iterdir()} == dict.fromkeys(
        ["config.json", "evaluations.csv"], "whole"
    )
    assert [path.name for path in part.parent.iterdir()] == ["run"]


@pytest.fixture
def cluster():
    pytest.importorskip("ray", reason="the extra ray is not installed")
    from ray.cluster_utils import Cluster

    os.environ["RAY_ENABLE_UV_RUN_RUNTIME_ENV"] = "0"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield cluster
    cluster.shutdown()


def test_no_cluster_is_one_line(tmp_path):
    pytest.importorskip("ray", reason="the extra ray is not installed")
    with pytest.raises(InputError, match=r"there is no Ray cluster at '127\.0\.0\.1:1'"):
        Sweep(plan("seed=0"), tmp_path).fill(ray="127.0.0.1:1")


def test_a_node_that_is_killed_loses_nothing(tmp_path, cluster):
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
