"""Sweeps of runs with user code: its digest in the rows, and the effect of a change."""

import sys
from pathlib import Path

import pytest
from tiny_sweep import plan, results, tiny_words

from hierroom.commands.sweep import main
from hierroom.lab.sweep import job
from hierroom.lab.sweep.sweep import Sweep
from hierroom.runs.folder.provenance import record_session
from hierroom.runs.session import begin
from hierroom.support.errors import InputError


@pytest.fixture
def user_code(tmp_path, monkeypatch):
    """Make the folder of the test current and importable, for modules that tests write there."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [str(tmp_path), *sys.path])


@pytest.mark.slow
def test_row_has_the_digest_of_user_code(user_code, tmp_path, capsys):
    own = tmp_path / "own_reward_of_a_sweep.py"
    own.write_text("import numpy as np\n\ndef none(step):\n    return np.zeros(len(step.events))\n")
    words = tiny_words(f"reward={own.stem}:none,intrinsic", "method=ppo", "seed=0")
    words += ["--out", "out", "--processes", "1", "--episodes", "10"]
    assert main(words) == 0
    rows = results(tmp_path / "out" / "sweep.csv")
    assert {row["reward"]: len(row["own_code"]) for row in rows} == {f"{own.stem}:none": 16, "intrinsic": 0}
    assert main(words) == 0
    assert "warning" not in capsys.readouterr().err
    own.write_text(own.read_text() + "# changed\n")
    assert main(words) == 0
    said = capsys.readouterr().err
    assert said.startswith("warning: own code has changed since ")
    assert said.endswith("trained; to train again, delete the rows from out/sweep.csv, and the folders in out/runs\n")
    assert results(tmp_path / "out" / "sweep.csv") == rows


def test_missing_user_code_does_not_count_as_changed(user_code, tmp_path):
    sweep = Sweep(plan("reward=a_reward_that_moves:none", "method=ppo", "seed=0"), tmp_path / "out")
    (run,) = sweep.plan.runs()
    Path("a_reward_that_moves.py").write_text("", encoding="utf-8")
    (tmp_path / "out").mkdir()
    sweep.table.add(run, {"own_code": "0" * 16})
    assert sweep.made_with_other_code() == [run.name]
    Path("a_reward_that_moves.py").unlink()
    assert sweep.made_with_other_code() == []


@pytest.mark.slow
def test_user_code_of_metas_is_compared(user_code, tmp_path):
    Path("a_meta_of_a_sweep.py").write_text(
        "def first(level):\n    return level.goals[0] if level.goals else None\n", encoding="utf-8"
    )
    sweep = Sweep(plan(metas=("a_meta_of_a_sweep:first",), seeds=1), tmp_path / "out")
    assert not sweep.fill(processes=1).failures
    assert [*sweep.rows()["own_code"].str.len()] == [16]
    assert sweep.made_with_other_code() == []
    with Path("a_meta_of_a_sweep.py").open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    assert len(sweep.made_with_other_code()) == 1


@pytest.mark.slow
def test_run_is_not_resumed_with_changed_code(user_code, tmp_path):
    own = Path("a_reward_that_changes.py")
    own.write_text("import numpy as np\n\ndef none(step):\n    return np.zeros(len(step.events))\n", encoding="utf-8")
    sweep = Sweep(plan(f"reward={own.stem}:none", "method=ppo", "seed=0"), tmp_path / "out")
    (run,) = sweep.plan.runs()
    folder = begin(run.config, tmp_path / "out" / "runs" / run.name)[1]
    folder.lock.release()
    record_session(folder.path, run.config)
    own.write_text(own.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    ((failed, reason),) = sweep.fill(processes=1).failures
    assert failed == run
    assert f"{own} has changed since {folder.path} was trained" in reason
    assert reason.endswith(f"; move {folder.path} away to train this run with the code as it is now")
    folder.path.rename(tmp_path / "away")
    assert not sweep.fill(processes=1).failures
    assert sweep.made_with_other_code() == []


def test_code_changed_during_a_sweep_raises_input_error(user_code, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "_loaded_files", {})
    own = Path("a_reward_edited_meanwhile.py")
    own.write_text(
        "import numpy as np\n\ndef one(step):\n    return np.zeros(len(step.events))\n\ntwo = one\n", encoding="utf-8"
    )
    one, two = plan(f"reward={own.stem}:one,{own.stem}:two", "method=ppo", "seed=0").runs()
    assert job.Job(one, tmp_path / "one", 4, (), "").work(lambda steps, words: None)
    own.write_text(own.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"^{own} changed while the sweep went on; begin the sweep again to load it"):
        job.Job(two, tmp_path / "two", 4, (), "").work(lambda steps, words: None)
    assert not (tmp_path / "two").exists()
