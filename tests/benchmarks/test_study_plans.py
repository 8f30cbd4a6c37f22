"""The plans of the study: its goal graphs, what its sweeps change, and the settings that were tuned."""

import csv
from collections import Counter
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

from benchmarks.study import comparisons, tuning
from benchmarks.study import graphs as study
from benchmarks.study.trained import method_names
from hierroom.complexity import GraphSet
from hierroom.lab.sweep.plan import read_plan
from hierroom.runs.config.presets import PRESETS

ROOT = Path(__file__).parents[2]


def test_study_graphs_are_all_small_and_sampled_large():
    graphs = study.study_graphs(n_sampled=3)
    rooms = [graph.n_rooms for graph in graphs]
    assert [rooms.count(n) for n in range(2, 8)] == [1, 3, 9, 26, 3, 3]
    assert len({graph.canonical() for graph in graphs}) == len({graph.name for graph in graphs}) == len(graphs)
    assert graphs == study.study_graphs(n_sampled=3)
    assert graphs != study.study_graphs(n_sampled=3, seed=1)


def test_twins_are_isomorphic_but_not_equal():
    originals = {graph.name: graph for graph in study.study_graphs(0)}
    twins = study.twins()
    assert len(twins) == 9
    for name, twin in twins.items():
        assert twin.canonical() == originals[name].canonical()
        assert twin != originals[name]
        assert twin.name == f"keys-{'-'.join(map(str, twin.key_rooms))}-exit-{twin.exit_room}"


def plan(name):
    return read_plan(ROOT / "benchmarks" / "sweeps" / f"{name}.toml")


def test_sweeps_train_study_graphs_and_twins_alike():
    plans = [plan("study"), plan("study_twins")]
    assert replace(plans[0], graphs=()) == replace(plans[1], graphs=())
    wanted = [study.study_graphs(), tuple(study.twins().values())]
    for one, own in zip(plans, wanted, strict=True):
        runs = one.runs()
        assert len(runs) == 20 * len(own)
        assert {run.identity["graph"] for run in runs} == {graph.name for graph in own}
    assert {graph.name for own in wanted for graph in own} == {row["graph"] for row in committed("study/measures.csv")}


@pytest.mark.parametrize("name", ["study", "study_twins", "study_levels", "study_unseen"])
def test_paper_features_sweep_differs_only_in_features(name):
    papers_name = "study_paper_features" if name == "study" else f"{name}_paper_features"
    own, papers = (plan(each).runs() for each in (name, papers_name))
    features, seeds = PRESETS["paper"].agents.features, {run.config.seed for run in papers}
    asked = [run for run in own if run.config.seed in seeds]
    expected = {replace(run.config, agents=replace(run.config.agents, features=features)) for run in asked}
    assert {run.config for run in papers} == expected
    assert len(seeds) == (5 if name == "study_unseen" else 3)


def by_expected_steps():
    """The study's graphs of each number of rooms from four on, those with fewer expected steps first."""
    rows = [row for row in committed("study/measures.csv") if not row["twin_of"] and int(row["rooms"]) > 3]
    rows.sort(key=lambda row: float(row["expected_steps"]))
    return [[row["graph"] for row in rows if row["rooms"] == rooms] for rooms in sorted({row["rooms"] for row in rows})]


@pytest.mark.parametrize(("name", "n_changes"), [("study_factors", 10), ("study_factors_paper_features", 7)])
def test_factor_sweeps_change_one_entry_on_chosen_graphs(name, n_changes):
    runs = plan(name).runs()
    chosen = {graphs[place] for graphs in by_expected_steps() for place in (0, len(graphs) // 2, -1)}
    assert {run.identity["graph"] for run in runs} == chosen
    as_it_is = {
        (run.identity["graph"], run.config.seed): run.config for run in runs if run.identity["variant"] == "as it is"
    }
    assert {config.ppo for config in as_it_is.values()} == {
        run.config.ppo for run in plan("study").runs() if run.identity["method"] == "hippo"
    }
    changes = {
        (run.identity["variant"], len(run.config.differences(as_it_is[run.identity["graph"], run.config.seed])))
        for run in runs
        if run.identity["method"] == "hippo"
    }
    assert len(changes) == 1 + n_changes
    assert changes - {("as it is", 0)} == {(variant, 1) for variant, _ in changes if variant != "as it is"}


def test_level_sweep_changes_one_entry_on_median_graphs():
    runs, changes = plan("study_levels").runs(), set()
    assert {run.identity["graph"] for run in runs} == {graphs[len(graphs) // 2] for graphs in by_expected_steps()}
    own = {(run.identity["graph"], run.identity["method"], run.config.seed): run.config for run in plan("study").runs()}
    for run in runs:
        unchanged = own[run.identity["graph"], run.identity["method"], run.config.seed]
        changed = run.config.differences(unchanged)
        (change,) = (one for one in changed if not one.startswith("graph is 'e'"))  # by name, and once by content
        changes.add((run.identity["method"], change))
    assert len(changes) == 2 * 3, changes


def test_unseen_sweep_excludes_every_fourth_or_six_room_graph():
    runs, excluded = plan("study_unseen").runs(), set()
    tuned = {(run.identity["method"], run.config.ppo) for run in plan("study").runs()}
    assert {(run.identity["method"], run.config.ppo) for run in runs} == tuned
    for run in runs:
        graphs = GraphSet(run.config.env.graph, run.config.env.exclude)
        left_out = {graph.name for graph in graphs.excluded}
        if {graph.n_rooms for graph in graphs.excluded} == {6}:
            assert len(left_out) == 75
            assert len(graphs.graphs) == 9 + 26
        else:
            assert left_out == {name for of_one in by_expected_steps()[:2] for name in of_one[2::4]}
            assert len(graphs.graphs) == 9 + 26 - len(left_out)
        excluded.add((run.identity["method"], len(left_out)))
    assert excluded == {(method, n) for method in ("hippo", "ppo-bonus") for n in (8, 75)}


def best_settings(*sweeps):
    found = tuning.tuned([row for sweep in sweeps for row in committed(f"{sweep}/sweep.csv")])
    assert {len(one.areas) for one in found} == {6}
    assert {len(of) for one in found for of in one.areas.values()} == {3}
    return {(one.method, *(dict(one.best).get(name) for name in tuning.TUNED)) for one in found}


def settings_of(runs, sweeps):
    tuned = {method: names for method, *names in best_settings(*sweeps)}
    settings = set()
    for run in runs:
        ppo, method = run.config.ppo, run.identity["method"]
        values = ppo.learning_rate, run.config.env.novelty_bonus, run.config.agents.curiosity_weight, ppo.gamma
        given = (None if one is None else value for one, value in zip(tuned[method], values, strict=True))
        settings.add((method, *given))
    return settings


def test_study_uses_the_best_tuned_settings():
    assert settings_of(plan("study").runs(), ["tuning"]) == best_settings("tuning")


def test_other_methods_are_tuned_with_the_same_budget():
    own, others = plan("tuning").runs(), plan("tuning_others").runs()
    assert {(run.identity["graph"], run.config.seed, run.config.steps) for run in others} == {
        (run.identity["graph"], run.config.seed, run.config.steps) for run in own
    }
    budgets = Counter(run.identity["method"] for run in (*own, *others))
    factors = {run.identity["method"] for run in plan("study_factors").runs()}
    assert budgets == dict.fromkeys(factors, 6 * 3)
    weights = {run.config.env.novelty_bonus for run in others} | {run.config.agents.curiosity_weight for run in others}
    assert weights == {0.01, 0.03, 0.1, 0.015, 0.05, 0.15}


def test_other_methods_use_their_best_tuned_settings():
    runs = [run for run in plan("study_factors").runs() if run.identity["variant"].startswith("tuned")]
    assert settings_of(runs, ["tuning_others"]) == best_settings("tuning_others")


def test_paper_features_are_tuned_with_the_same_settings():
    papers = {run.config for run in plan("tuning_paper_features").runs()}
    own = [run.config for name in ("tuning", "tuning_others") for run in plan(name).runs()]
    features = PRESETS["paper"].agents.features
    assert papers == {replace(config, agents=replace(config.agents, features=features)) for config in own}


def test_paper_feature_factors_use_their_own_tuned_settings():
    own, others = plan("study_factors_paper_features"), plan("study_factors_paper_features_others")
    assert replace(own, variants=()) == replace(others, variants=())
    runs = [*own.runs(), *others.runs()]
    tuned = [run for run in runs if run.identity["variant"] != "gamma 0.98"]
    assert settings_of(tuned, ["tuning_paper_features"]) == best_settings("tuning_paper_features")
    papers = PRESETS["paper"].agents.features
    features = {run.identity["variant"]: run.config.agents.features for run in runs}
    assert {variant: of for variant, of in features.items() if of != papers} == {"goal not observed": papers[:1]}


REWARDS = {
    None: ("given goal", "cut"),
    "benchmarks.variants:CutBonus": ("any event", "cut"),
    "benchmarks.variants:UncutIntrinsic": ("given goal", "not cut"),
    "bonus": ("any event", "not cut"),
}


def cell(run):
    """Return a run's cell of the table: is its goal observed, what is rewarded, and are returns cut?"""
    if run.identity["method"] == "ppo-bonus":
        return ("not observed", "any event", "not cut")
    is_observed = any(name.startswith("goal") for name in run.config.agents.features)
    return ("observed" if is_observed else "not observed", *REWARDS[run.config.env.reward])


@pytest.mark.parametrize("name", ["study_factors", "study_factors_paper_features"])
def test_crossed_sweep_varies_only_three_factors(name):
    runs = plan(f"{name}_crossed").runs()
    names = method_names([run.identity for run in runs])
    cells = {method: cell(run) for run, method in zip(runs, names, strict=True)}
    assert sorted(cells.values()) == sorted(
        product(("observed", "not observed"), ("given goal", "any event"), ("cut", "not cut"))
    )
    assert len({run.config.ppo for run in runs}) == 1
    others = {tuple(one for one in run.config.agents.features if not one.startswith("goal")) for run in runs}
    assert len(others) == 1
    wholes = {run.digest for run in plan(name).runs()}
    assert Counter(run.digest in wholes for run in runs) == {True: 5 * 12 * 3, False: 3 * 12 * 3}
    path = ROOT / "benchmarks" / "study" / f"{name}_crossed_comparisons.toml"
    planned = comparisons.read_comparisons(path)
    changes = [
        [
            (before, after)
            for before, after in zip(cells[one.reference], cells[one.method], strict=True)
            if before != after
        ]
        for one in planned
    ]
    one_change = [("observed", "not observed")], [("given goal", "any event")], [("cut", "not cut")]
    assert changes == [change for change in one_change for _ in range(4)]
    assert len({(one.method, one.reference) for one in planned}) == 12
    assert {one.outcome for one in planned} == {"steps_to_50"}


def committed(name):
    with (ROOT / "benchmarks" / "results" / name).open() as file:
        return list(csv.DictReader(file))
