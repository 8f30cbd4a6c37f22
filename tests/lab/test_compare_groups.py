"""The groups of a comparison: the entries that make them, their names, and notes on how their runs differ."""

import json
import shutil

import pytest
from evaluated_runs import line, make_run, rows

from hierroom.lab.compare.evaluated_run import read_run
from hierroom.lab.compare.grouping import choose_groups, describe_differences
from hierroom.runs.folder.provenance import record_session
from hierroom.runs.folder.run_folder import RunFolder


def make_runs(folder, *choices):
    """Make a run of each of two seeds for each choice of entries, in which ``{seed}`` is the seed."""
    for seed in range(2):
        for n, choice in enumerate(choices):
            entries = {name: value.format(seed=seed) if "warm" in name else value for name, value in choice.items()}
            make_run(folder / f"{n}{seed}", {"c": line(0.5)}, **{"seed": seed, "threads": seed + 1, **entries})
    return folder


def groups_in(folder):
    return list(dict.fromkeys(one["group"] for one in rows(folder / "summary.csv")))


PPO, HIPPO, RANDOM = {"method": "ppo"}, {"method": "hippo"}, {"method": "hippo", "meta": "random"}
WARM = {"warm_start": "runs/hippo-a-seed{seed}"}


@pytest.mark.parametrize(
    ("choices", "by", "groups", "said"),
    [
        ([{"gamma": 0.99}, {"gamma": 0.9}], None, ["gamma 0.9", "gamma 0.99"], "compared by gamma, as no --by was"),
        ([PPO, HIPPO, RANDOM], None, ["ppo", "hippo, fixed-dfs", "hippo, random"], "compared by method, meta, as no"),
        ([WARM, {}], None, ["hippo-a", "no warm start"], "compared by warm_start, as no"),
        ([PPO, HIPPO], "meta,reward", ["none, extrinsic", "fixed-dfs, intrinsic"], "the groups differ also in method"),
        ([{}, {"num_envs": 8}], "num-envs", ["num_envs 8", "num_envs 64"], "num_envs 8"),
        ([{}], "num_envs, meta-ppo.gamma", ["num_envs 64, meta_ppo.gamma 0.998"], "meta_ppo.gamma 0.998"),
    ],
)
def test_runs_are_grouped_by_given_or_differing_entries(tmp_path, compare, choices, by, groups, said):
    printed = " ".join(compare(make_runs(tmp_path / "r", *choices), by=by).split())
    assert groups_in(tmp_path / "here" / "compare") == groups
    assert said in printed
    assert "not comparable" not in printed


def test_returns_of_different_rewards_are_not_comparable(tmp_path, compare):
    printed = compare(make_runs(tmp_path / "r", PPO, HIPPO), outcome="return")
    assert "returns of different rewards (extrinsic, intrinsic) are not comparable" in printed
    assert "differ also in" not in printed  # meta-controller and reward follow from the method


def test_compare_groups_runs_by_sweep_variant(tmp_path, compare, refused):
    runs, out = tmp_path / "r", tmp_path / "here" / "compare"
    for seed in range(2):
        for name, entries in {"slow, HiPPO": {"gamma": 0.9, "learning_rate": 1e-4}, "quick": {"gamma": 0.99}}.items():
            path = make_run(runs / f"{name}{seed}", {"c": line(0.5)}, seed=seed, **entries)
            record_session(path, RunFolder(path).config(), name)
            record_session(path, RunFolder(path).config())  # it was resumed
    printed = compare(runs)
    assert "compared by variant, as no --by was given" in printed
    assert "the groups differ also in learning_rate, gamma" in printed
    assert groups_in(out) == ["quick", "slow, HiPPO"]
    path = make_run(runs / "other", {"c": line(0.5)})
    compare(runs, by="variant")
    assert set(groups_in(out)) == {"quick", "slow, HiPPO", "no variant"}
    compare(runs, by="variant,method")
    assert set(groups_in(out)) == {"quick, hippo", "slow, HiPPO, hippo", "hippo"}
    (path / "provenance.json").write_text("[" * 10**5 + "]" * 10**5, encoding="utf-8")
    printed = compare(runs, by="variant")
    assert f"- left out: cannot read {path / 'provenance.json'}: maximum recursion depth exceeded" in printed
    assert set(groups_in(out)) == {"quick", "slow, HiPPO"}
    (path / "provenance.json").unlink()
    shutil.copytree(path, runs / "renamed")
    record_session(runs / "renamed", RunFolder(path).config(), "quick")
    refused(r"other and .*renamed have the same seed, 0, and", runs, by="gamma")


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("hippo-a-seed1", "hippo-a"),
        ("hippo-a-seed1-steps500k-2", "hippo-a-steps500k"),
        ("hippo-a-seed1-gamma0.9-fbd761", "hippo-a-gamma0.9"),
        ("seedling-seed1s", "seedling-seed1s"),
    ],
)
def test_warm_start_name_leaves_out_the_seed(tmp_path, folder, name):
    run = make_run(tmp_path / "run", {"a": line(0.5)}, warm_start=f"runs/{folder}")
    assert read_run(run).choice("warm_start") == name


def test_control_characters_in_run_names_are_escaped(tmp_path):
    path = make_run(tmp_path / "run", {"a\x1b[31m": line(0.5)}, graph="a", network="own:\udcff")
    (path / "provenance.json").write_text(r'{"sessions": [{"variant": "=x\ud800\u001b[31m\n"}]}')
    run = read_run(path)
    assert (run.choice("variant"), run.choice("network")) == (r"=x\ud800\x1b[31m\n", r"own:\udcff")
    assert [*run.curves] == [r"a\x1b[31m"]


def test_group_of_differing_runs_is_reported(tmp_path, compare):
    for seed, gamma in enumerate((0.9, 0.95)):
        make_run(tmp_path / "r" / f"{seed}", {"c": line(0.5)}, seed=seed, gamma=gamma, size=11 + 2 * seed)
    assert "hippo mixes runs that differ in size (11, 13), gamma (0.9, 0.95)" in compare(tmp_path / "r", by="method")


def notes_on(*paths):
    return describe_differences(choose_groups([read_run(path) for path in paths], "method"), ["method"])


@pytest.mark.parametrize("differs", ["module", "resumed", "hierroom", "numpy", "weights"])
def test_runs_of_different_code_are_reported(tmp_path, monkeypatch, differs):
    (tmp_path / "mine.py").write_text("one")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hierroom.runs.folder.provenance.describe_git", lambda *_: None)
    paths = [
        make_run(tmp_path / f"{seed}", {"c": line(0.5)}, seed=seed, meta="mine:M", warm_start="base")
        for seed in range(2)
    ]
    path, config = paths[1], RunFolder(paths[1]).config()
    for one in paths:
        record_session(one, config, warm_start=64 * "a")
    assert notes_on(*paths) == []
    if differs in ("module", "resumed"):
        (tmp_path / "mine.py").write_text("two")
    if differs == "hierroom":
        monkeypatch.setattr("hierroom.__version__", "9.9.9")
    if differs == "numpy":
        monkeypatch.setattr("hierroom.runs.folder.provenance.version", lambda name: "9.9.9")
    if differs != "resumed":
        (path / "provenance.json").unlink()
    record_session(path, config, warm_start=64 * ("b" if differs == "weights" else "a"))
    name = {"module": "mine.py", "resumed": "mine.py", "weights": "the weights of base"}.get(differs, differs)
    (note,) = notes_on(*paths)
    assert note.startswith("hippo was trained with different code: ")
    assert f"{name} (" in note
    assert ("9.9.9" in note) == (differs in ("hierroom", "numpy"))


def test_runs_without_recorded_code_are_reported(tmp_path, compare):
    paths = [make_run(tmp_path / "r" / f"{seed}", {"c": line(0.5)}, seed=seed) for seed in range(3)]
    for path in paths:
        record_session(path, RunFolder(path).config())
    (paths[1] / "provenance.json").unlink()
    sessions = json.loads((paths[2] / "provenance.json").read_text())["sessions"]
    (paths[2] / "provenance.json").write_text(json.dumps({"sessions": [*sessions, {"packages": {}}]}))
    assert f"does not say with which code these were trained: {paths[1]}, {paths[2]}" in compare(tmp_path / "r")
