"""The study's statistics, on tables with known answers."""

import numpy as np
import pytest
from scipy.stats import pearsonr, rankdata, spearmanr
from study_tables import measured_rows, run_rows

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import (
    Estimate,
    ceiling,
    correlations,
    estimates,
    interval,
    noise_of_twins,
    resampled,
    split_half,
    twin_factor,
)
from benchmarks.study.trained import by_rule, measures_of, medians, read_trained
from hierroom.support.errors import InputError


def trained_of(steps, twins=()):
    graphs = [graph for graph in steps if not graph.endswith("-twin")]
    (trained,) = read_trained(run_rows(steps), measured_rows(graphs, twins), "steps_to_95")
    return trained


def test_medians_take_never_reached_as_infinite():
    inf, nan = np.inf, np.nan
    outcomes = np.array([[3, 1, 9], [5, 7, nan], [1, inf, nan], [1, 2, inf], [inf, inf, 4], [8, nan, nan]])
    assert medians(outcomes).tolist() == [3, 6, inf, 2, inf, 8]


def test_correlations_by_hand():
    """Ranks 1 2 3 5 4: rho = 1 - 6 * 2 / (5 * 24) = 0.9, tau = (9 - 1) / 10; goals 1 1 2 2 2: rho = 9 / sqrt(120)."""
    goals = np.array([3.0, 3, 5, 5, 5])
    table = correlations(np.array([10.0, 20, 30, 40, 50]), {"x": np.array([1.0, 2, 3, 9, 4]), "goals": goals}, goals)
    count = 0.8660254
    assert table["x", "spearman"] == pytest.approx(0.9)
    assert table["x", "kendall"] == pytest.approx(0.8)
    assert table["goals", "spearman"] == pytest.approx(count)
    assert table["x", "minus goals"] == pytest.approx(0.9 - count)
    assert table["x", "given goals"] == pytest.approx((0.9 - count**2) / (1 - count**2))
    assert table["goals", "minus goals"] == 0
    assert np.isnan(table["x", "minus hitting time"])
    assert np.isnan(table["goals", "given goals"])
    assert np.isnan(table["x", "at fixed goals"])  # no four graphs have as many


def test_differences_to_hitting_time_and_exit_depth():
    x, y = np.array([1.0, 2, 3, 4, 5]), np.array([1.0, 2, 3, 5, 4])
    measures = {"x": x, "hitting_time": y, "exit_depth": x[::-1]}
    table = correlations(x, measures, np.array([3.0, 3, 5, 5, 5]))
    assert table["x", "minus hitting time"] == pytest.approx(1 - 0.9)
    assert table["hitting_time", "minus exit depth"] == pytest.approx(0.9 + 1)
    assert table["hitting_time", "minus hitting time"] == 0


def test_never_reached_ranks_last_and_tied():
    """Ranks 1 2 3.5 3.5 against 1 2 3 4: rho = 4.5 / sqrt(4.5 * 5), tau-b = 5 / sqrt(5 * 6)."""
    table = correlations(np.array([5.0, 6, np.inf, np.inf]), {"x": np.array([1.0, 2, 3, 4])}, np.array([3.0, 3, 5, 5]))
    assert table["x", "spearman"] == pytest.approx(4.5 / np.sqrt(4.5 * 5))
    assert table["x", "kendall"] == pytest.approx(5 / np.sqrt(30))


def test_given_goals_equals_the_partial_correlation():
    rng = np.random.default_rng(0)
    goals = rng.integers(3, 7, 40).astype(float)
    x, y = goals + rng.normal(size=40), goals + rng.normal(size=40)
    table = correlations(y, {"x": x}, goals)
    z = np.column_stack([np.ones(40), rankdata(goals)])
    left = [rankdata(v) - z @ np.linalg.lstsq(z, rankdata(v), rcond=None)[0] for v in (x, y)]
    assert table["x", "given goals"] == pytest.approx(pearsonr(*left)[0])
    assert table["x", "spearman"] == pytest.approx(spearmanr(x, y)[0])


def test_given_exit_depth_equals_given_goals_of_depth():
    rng = np.random.default_rng(1)
    goals, depth = rng.integers(3, 7, 40).astype(float), rng.integers(2, 9, 40).astype(float)
    x, y = depth + rng.normal(size=40), depth + goals + rng.normal(size=40)
    measures = {"x": x, "exit_depth": depth, "twice": 2 * depth}
    table = correlations(y, measures, goals)
    of_depth = correlations(y, {"x": x}, depth)
    assert table["x", "given exit depth"] == of_depth["x", "given goals"] != table["x", "given goals"]
    assert np.isnan([table[name, "given exit depth"] for name in ("exit_depth", "twice")]).all()
    assert np.isnan(of_depth["x", "given exit depth"])


def test_at_fixed_goals_is_the_mean_weighted_by_graphs():
    goals = np.array([5.0] * 4 + [7.0] * 6 + [3.0] * 2)
    x = np.array([1.0, 2, 3, 4, 1, 2, 3, 4, 5, 6, 9, 8])
    y = np.array([1.0, 2, 3, 4, 6, 5, 4, 3, 2, 1, 7, 7])
    table = correlations(y, {"x": x}, goals)
    assert (table["x", "at 5 goals"], table["x", "at 7 goals"]) == (pytest.approx(1), pytest.approx(-1))
    assert table["x", "at fixed goals"] == pytest.approx((4 - 6) / 10)
    assert ("x", "at 3 goals") not in table


def test_the_bootstrap_draws_graphs_and_seeds():
    graphs = [f"g{i}" for i in range(20)]
    goals, x = np.repeat([5.0, 7.0], 10), np.arange(20.0)
    rng = np.random.default_rng(1)
    sure = trained_of({graph: [10 * i + 10] * 5 for i, graph in enumerate(graphs)})
    drawn = 10 * np.arange(20)[:, None] + 10 + rng.integers(0, 200, (20, 5))
    noisy = trained_of(dict(zip(graphs, drawn.tolist(), strict=True)))
    of_sure = estimates(sure, {"x": x, "goals": goals}, goals, Bootstrap(200))
    of_noisy = estimates(noisy, {"x": x, "goals": goals}, goals, Bootstrap(200))
    assert of_sure["x", "spearman"] == pytest.approx((1, 1, 1))
    assert of_sure["goals", "minus goals"] == (0, 0, 0)
    value, low, high = of_noisy["x", "spearman"]
    assert low < value < 1
    assert high - low > 0.1
    assert estimates(noisy, {"x": x}, goals, Bootstrap(200))["x", "kendall"] == of_noisy["x", "kendall"]
    only_graphs = estimates(
        trained_of({graph: [m] * 5 for graph, m in zip(graphs, np.median(drawn, axis=1), strict=True)}),
        {"x": x, "goals": goals},
        goals,
        Bootstrap(200),
    )["x", "spearman"]
    assert only_graphs.value == pytest.approx(value)
    assert only_graphs.high - only_graphs.low < high - low


def test_interval_is_corrected_for_bootstrap_bias():
    """The resamples 0.50, 0.51, ... 0.70 have a mean of 0.60, and their 5% and 95% points are 0.51 and 0.69."""
    resamples = np.linspace(0.5, 0.7, 21)
    assert interval(0.6, resamples, 0.9) == pytest.approx((0.6, 0.51, 0.69))
    assert interval(0.8, resamples, 0.9) == pytest.approx((0.8, 0.71, 0.89))
    assert interval(0.95, resamples, 0.9) == pytest.approx((0.95, 0.86, 1))
    assert interval(0.95, resamples, 0.9, bound=2) == pytest.approx((0.95, 0.86, 1.04))
    assert str(interval(-0.001, resamples - 0.601, 0.9)) == "0.00 [-0.09, 0.09]"
    few = np.where(np.arange(21) < 3, np.nan, resamples)
    assert str(interval(0.6, few, 0.9)) == "0.60"
    assert str(interval(np.nan, resamples, 0.9)) == "-"


def test_seeds_are_resampled_within_their_graph():
    outcomes = np.array([[1.0, 2, 3], [4, np.nan, np.nan], [5, 6, np.nan]])
    rng = np.random.default_rng(3)
    for _ in range(50):
        drawn = resampled(outcomes, rng)
        assert (np.isnan(drawn) == np.isnan(outcomes)).all()
        assert set(drawn[0]) <= {1, 2, 3}
        assert set(drawn[2, :2]) <= {5, 6}


def test_split_half_of_sure_noisy_and_odd_seeds():
    sure = trained_of({f"g{i}": [i + 1] * 4 for i in range(10)})
    assert split_half(sure, Bootstrap(20)) == pytest.approx((1, 1, 1))
    rng = np.random.default_rng(4)
    noise = trained_of({f"g{i}": rng.random(4).tolist() for i in range(200)})
    value, low, high = split_half(noise, Bootstrap(50))
    assert abs(value) < 0.15
    assert low < 0 < high
    for odd in (1, 3):
        unequal = trained_of({f"g{i}": [i + 1] * (odd if i == 5 else 4) for i in range(10)})
        assert np.isnan(split_half(unequal, Bootstrap()).value)


def test_ceiling_equals_spearman_brown_formula():
    """By Spearman and Brown's formula."""
    assert ceiling(Estimate(0.6, -0.2, 1.0)) == pytest.approx((0.75**0.5, 0, 1))
    assert np.isnan(ceiling(Estimate(np.nan, np.nan, np.nan))).all()


def test_noise_and_factor_of_twins_by_hand():
    steps = {f"g{i}": [10 * i + 10] * 3 for i in range(6)} | {f"g{i}-twin": [15 * i + 15] * 3 for i in range(4)}
    trained = trained_of(steps, [f"g{i}" for i in range(4)])
    assert trained.graphs == tuple(f"g{i}" for i in range(6))
    assert noise_of_twins(trained, Bootstrap(20)).value == pytest.approx(1)
    assert twin_factor(trained) == pytest.approx(1.5)
    alone = trained_of({f"g{i}": [1] for i in range(4)})
    assert np.isnan(noise_of_twins(alone, Bootstrap()).value)
    assert np.isnan(twin_factor(alone))


def test_measures_of_negates_rounds_and_drops_columns():
    rows = measured_rows(
        list("abcd"),
        goals=[3, 5, 5, 7],
        pic=[0.4, 0.3, 0.2, 0.1],
        expected_steps=[62.86893904411534, 62.86893904411533, 70, "inf"],
        effective_horizon=[1.0] * 4,
        level_pic=[0.1, "", 0.2, 0.3],
    )
    measures = measures_of("abcd", rows)
    assert list(measures) == ["goals", "expected_steps", "pic"]
    assert measures["pic"].tolist() == [-0.4, -0.3, -0.2, -0.1]
    assert measures["expected_steps"][0] == measures["expected_steps"][1]
    assert measures["expected_steps"][3] == np.inf


@pytest.mark.parametrize(("n_never", "methods"), [(2, (["hippo", "ppo"], [])), (3, (["ppo"], ["hippo"]))])
def test_by_rule_uses_50_if_95_is_rarely_reached(n_never, methods):
    steps = {graph: [100, *[None if i < n_never else 100] * 2] for i, graph in enumerate("abcdef")}
    rows = [{**row, "steps_to_50": "50"} for row in run_rows(steps)]
    rows += [{**row, "method": "ppo", "steps_to_95": "90"} for row in rows]
    found = by_rule(rows, measured_rows(list("abcdef")))
    assert tuple([one.method for one in found[name]] for name in ("steps_to_95", "steps_to_50")) == methods
    assert all((one.outcomes == 50).all() for one in found["steps_to_50"])


def test_method_names_include_differing_columns():
    read, steps = read_trained, {graph: [1, 2] for graph in "abcd"}
    rows = run_rows(steps, size="19", preset="default") + run_rows(steps, size="31", preset="default")
    found = read(rows, measured_rows(list("abcd")), "steps_to_95")
    assert [one.method for one in found] == ["hippo 19", "hippo 31"]
    assert [one.never for one in found] == [0, 0]
    rows = run_rows(steps, meta="fixed-dfs") + run_rows(steps, method="ppo", meta="none")
    assert [one.method for one in read(rows, measured_rows(list("abcd")), "steps_to_95")] == ["hippo", "ppo"]
    rows += run_rows(steps, meta="random")
    found = read(rows, measured_rows(list("abcd")), "steps_to_95")
    assert [one.method for one in found] == ["hippo fixed-dfs", "ppo", "hippo random"]
    rates = [{**row, "success_rate": rate} for row, rate in zip(run_rows(steps), ["1", "0.5"] * 4, strict=True)]
    (one,) = read(rates, measured_rows(list("abcd")), "success_rate")
    assert one.outcomes.tolist() == [[0, 0.5]] * 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: [], "no runs with graph, method, seed, steps_to_95"),
        (lambda rows: [{**row, "graph": row["graph"] * 2} for row in rows], "4 graphs are in no row .* such as 'aa'"),
        (lambda rows: rows + rows[:1], "seed 0 of hippo on a stands in the table twice"),
        (lambda rows: [{**row, "steps_to_95": "many"} for row in rows], "steps_to_95 of hippo on a is no number"),
        (lambda rows: [{**row, "steps": str(i)} for i, row in enumerate(rows)], "hippo are of different lengths"),
    ],
)
def test_invalid_tables_raise_input_error(change, message):
    rows = run_rows({graph: [1, 2] for graph in "abcd"})
    with pytest.raises(InputError, match=message) as caught:
        read_trained(change(rows), measured_rows(list("abcd")), "steps_to_95")
    assert "\n" not in str(caught.value)
