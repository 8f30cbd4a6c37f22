"""What advice predicted shows in the run, its report and a comparison; a wrong prediction is said plainly."""

import math
from pathlib import Path

import pytest
from evaluated_runs import make_run, rise

import hierroom
from hierroom.__main__ import main
from hierroom.lab.compare.evaluated_run import read_run
from hierroom.lab.report.curves import compare_runs, curve_rows
from hierroom.lab.report.runs import read_runs
from hierroom.runs.folder.predicted import FILE, Prediction, Steps, keep_prediction, prediction_of, saved_at
from hierroom.support.errors import InputError
from hierroom.support.files import to_json

HIPPO = Prediction("hippo", Steps(50e3, 25e3, 100e3), Steps(200e3, 100e3, 400e3))
BONUS = Prediction("ppo-bonus", Steps(280e3, 110e3, math.inf))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def save(key):
    saved_at(key).parent.mkdir(parents=True, exist_ok=True)
    table = {one.method: one.to_dict() for one in (HIPPO, BONUS, Prediction("ppo"))}
    saved_at(key).write_text(to_json({"task": key, "predictions": table}))


def test_run_of_the_same_task_limit_and_preset_keeps_and_prints_it(capsys):
    tiny = {"graph": "a", "size": 11, "max_steps": 50, "steps": 256, "num_envs": 8, "evaluations": 2}
    save("a size=11 max_steps=50")
    hierroom.train(**tiny, film=False, out="run")
    printed = capsys.readouterr().out
    assert "predicted: 50% after 50k [25k, 100k], 95% after 200k [100k, 400k] steps\n" in printed
    assert "50% predicted 50k [25k, 100k], measured more than 256; 95% predicted" in printed
    kept = prediction_of(Path("run"))
    assert (kept.method, kept.steps_to, kept.steps_to_50.low) == ("hippo", HIPPO.steps_to, 25e3)


@pytest.mark.parametrize(
    "other",
    [{"size": 13}, {"max_steps": 60}, {"method": "ppo"}, {"meta": "learned"}, {"preset": "long"}, {"drop_key": True}],
)
def test_other_runs_have_none(other):
    save("a size=11 max_steps=50")
    usual = {"graph": "a", "size": 11, "max_steps": 50} | other
    config = hierroom.find_preset(usual.pop("preset", "default")).changed(**usual)
    keep_prediction(config, Path())
    assert prediction_of(Path()) is None


def test_wrong_prediction_is_said_and_the_report_has_its_band(compare):
    save("c")
    for method in ("hippo", "ppo-bonus"):
        path = make_run(Path("runs") / method, {"c": rise(130e3)}, method=method)
        keep_prediction(read_runs([path])[0][0].config, path)
    text = compare(*Path("runs").resolve().iterdir())
    assert "hippo on c: 50% predicted 50k [25k, 100k], measured 131k: outside the interval; 95% pred" in text
    assert "ppo-bonus on c: 50% predicted 280k [110k, beyond], measured 131k\n" in text
    rows = curve_rows(compare_runs(read_runs(Path("runs").resolve().iterdir())[0], None))
    bands = [row["predicted"] for row in rows if row["metric"] == "success_rate"]
    assert sorted(bands) == [[[50, 50e3, 25e3, 100e3], [95, 200e3, 100e3, 400e3]], [[50, 280e3, 110e3, None]]]
    assert not any(row["predicted"] for row in rows if row["metric"] == "length")


@pytest.mark.parametrize(
    ("measured", "end", "is_outside"),
    [
        (24e3, 1e6, True),
        (25e3, 1e6, False),
        (100e3, 1e6, False),
        (101e3, 1e6, True),
        (math.inf, 90e3, False),
        (math.inf, 101e3, True),
    ],
)
def test_what_is_outside_the_interval(measured, end, is_outside):
    assert ("outside" in HIPPO.judged({50: measured, 95: 200e3}, end).split(";")[0]) == is_outside


@pytest.mark.parametrize("text", ["[]", '{"task": "c", "predictions": {"hippo": {"method": 1}}}'])
def test_changed_file_is_refused_in_one_line(text):
    path = make_run(Path("runs") / "one", {"c": rise(130e3)})
    (path / FILE).write_text(text)
    with pytest.raises(InputError, match=r"advice\.json is not advice as hierroom writes it"):
        read_run(path)


def test_advice_is_saved_and_its_command_names_the_same_environments(capsys):
    assert main(["advise", "a", "--size", "17", "--drop", "--play-steps", "60000"]) == 0
    assert "train --graph a --drop-key --size=17" in capsys.readouterr().out
    assert Path("advice/a-size-17-drop_key-True.json").is_file()
