"""The paper's Table 3 and figures, from rows made by hand, and all of them once from nothing, very small."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hierroom.errors import InputError, RunError
from hierroom.paper import PAPER_TABLE_3, table3
from hierroom.paper.figures import _limited
from hierroom.paper.runs import PaperRuns, mean_and_interval


def row(method: str, graph: str, seed: int, success: float, length: float) -> dict[str, str]:
    numbers = {"success_rate": str(success), "length": str(length), "seed": str(seed), "size": "19"}
    return {"method": method, "graph": graph, **numbers, "digest": f"{method}{graph}{seed}"}


def test_a_mean_has_the_interval_of_student():
    mean, half_width = mean_and_interval(np.array([1.0, 2.0, 3.0]))
    assert mean == 2
    assert half_width == pytest.approx(4.302653 * 1 / np.sqrt(3), rel=1e-6)  # t of 2 degrees of freedom, deviation 1
    assert np.isnan(mean_and_interval(np.array([[1.0, 2.0]]))[1]).all(), "one seed tells of no spread"


def test_our_cells_stand_beside_those_of_the_paper():
    rows = [row("hippo", "a", seed, success, 300) for seed, success in enumerate((0.5, 0.7))]
    (cell,) = table3.table_3([*rows, row("hippo", "a", 5, 0.1, 9) | {"size": "31"}], (19,))
    assert (cell.paper_success, cell.paper_length) == (74.9, 48.2)
    assert (cell.success, cell.length, cell.seeds) == (pytest.approx(60), pytest.approx(30), 2)
    assert cell.success_half_width == pytest.approx(12.7062 * 10, rel=1e-4)
    assert cell.length_half_width == 0


def test_what_the_paper_prints_is_in_the_table():
    assert len(PAPER_TABLE_3) == 28
    assert PAPER_TABLE_3["ppo", "c"].length is None
    assert [PAPER_TABLE_3["hippo", graph].success for graph in "abcdefg"] == [74.9, 57.0, 60.8, 48.0, 29.9, 11.2, 19.0]


def test_an_episode_that_misses_a_goal_counts_as_the_limit():
    points = [{"achieved_key_1": "0.25", "steps_to_key_1": "100"}, {"achieved_key_1": "0", "steps_to_key_1": ""}]
    steps = [float(point["steps_to_key_1"]) for point in _limited({"d": points}, "key_1")["d"]]
    assert steps == [0.25 * 100 + 0.75 * 1000, 1000]


def test_what_the_paper_has_not_is_refused(tmp_path):
    with pytest.raises(InputError, match="the paper has the graphs a to g"):
        PaperRuns(out=tmp_path, graphs=("a", "z")).train("abcdefg")
    with pytest.raises(InputError, match="needs one of c, not 'a'"):
        PaperRuns(out=tmp_path, graphs=("a",)).train("c")
    with pytest.raises(InputError, match="sizes needs at least one grid size"):
        PaperRuns(out=tmp_path, sizes=())
    with pytest.raises(InputError, match="evaluations must be at least 1, not 0"):
        PaperRuns(out=tmp_path, evaluations=0)


def test_a_failed_run_is_no_wrong_input(tmp_path):
    runs = PaperRuns(out=tmp_path, graphs=("a",), seeds=1, processes=1)
    folder = tmp_path / "runs" / runs.sweep("a", ["hippo"]).plan.runs()[0].name
    folder.mkdir(parents=True)
    (folder / "config.json").write_text("{}")
    with pytest.raises(RunError, match="1 of 1 runs failed, hippo-fixed-dfs-a-seed0"):
        runs.train("a", ["hippo"])


def test_all_from_nothing_and_nothing_twice(tmp_path):
    words = "all --graphs c --seeds 1 --steps 1000 --evaluations 1 --evaluation-episodes 4 --episodes 4 --out p"
    command = [sys.executable, "-m", "hierroom.paper", *words.split()]
    first = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "4/4" in first.stderr
    told = " ".join(first.stdout.split())
    for words in ("Table 2", "PPO+Sketch, success paper 0.4", "HiPPO, length paper 69.1"):
        assert words in told
    for name in ("figure3-19", "figure4-19", "figure5-19"):
        pixels = np.asarray(Image.open(tmp_path / "p" / f"{name}.png").convert("RGB"))
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20
        assert (tmp_path / "p" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    table = (tmp_path / "p" / "sweep.csv").read_bytes()
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert again.stdout == first.stdout
    assert again.stderr == ""
    assert Path(tmp_path / "p" / "sweep.csv").read_bytes() == table
