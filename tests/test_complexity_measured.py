"""Chains counted from trajectories: hand-counted, against the walk they were drawn from, and their intervals."""

import numpy as np
import pytest
from counted_walks import count_transitions

from hierroom.complexity import analyze
from hierroom.complexity.measured import MeasuredReport
from hierroom.errors import InputError


def walk_episodes(report, n_episodes, max_steps, rng):
    """Trajectories of a report's own walk, an independent step-by-step simulation that is cut off at max_steps."""
    weights = report.chain.weights.toarray()
    chances = weights + np.diag(1 - weights.sum(axis=1))
    episodes = []
    for _ in range(n_episodes):
        nodes = [0]
        while len(nodes) <= max_steps and nodes[-1] != report.augmented.exit:
            nodes.append(int(rng.choice(len(chances), p=chances[nodes[-1]])))
        episodes.append(nodes)
    return episodes


@pytest.fixture(scope="module")
def measured():
    report = analyze("b")
    episodes = walk_episodes(report, 400, 10_000, np.random.default_rng(0))
    return MeasuredReport(report, count_transitions(episodes, report.nodes, 0, report.augmented.exit)), episodes


def test_counting_by_hand():
    counts = count_transitions([[0, 0, 1, 2], [0, 1, 1, 1]], n_nodes=3, start=0, exit_node=2)
    assert counts.lengths.tolist() == [3, 3]
    assert counts.escaped.tolist() == [True, False]
    # the second episode was truncated at node 1: one transition back to the start
    assert counts.total().toarray().tolist() == [[1, 2, 0], [1, 2, 1], [0, 0, 0]]
    assert counts.total([2, 0]).toarray().tolist() == [[2, 2, 0], [0, 0, 2], [0, 0, 0]]


def test_a_measured_chain_is_the_shares_of_its_counts():
    report = analyze("a")
    counts = count_transitions([[0, 0, 1, 3, 4], [0, 1, 3, 2]], report.nodes, 0, 4)
    chain = MeasuredReport(report, counts).chain.weights.toarray()
    np.testing.assert_allclose(
        chain,
        [
            [1 / 3, 2 / 3, 0, 0, 0],
            [0, 0, 0, 1, 0],
            [1, 0, 0, 0, 0],
            [0, 0, 1 / 2, 0, 1 / 2],
            [0.01, 0, 0, 0, 0],
        ],
    )


def test_the_chain_of_a_walk_is_that_walk(measured):
    report, _ = measured
    for name, interval in report.intervals.items():
        assert interval.low <= interval.value <= interval.high
        width = interval.high - interval.low
        assert abs(report.predictions[name] - interval.value) < width + 1e-6, name
        assert width < 0.4 * interval.value or name == "exit within 10"


def test_expected_steps_are_the_mean_of_the_episodes(measured):
    report, episodes = measured
    assert report.success_rate == 1
    mean = np.mean([len(nodes) - 1 for nodes in episodes])
    assert report.empirical_steps == pytest.approx(mean, rel=1e-12)
    assert report.chain.expected_steps == pytest.approx(mean, rel=1e-9)


def test_with_truncated_episodes_they_are_all_steps_per_escape():
    assumed = analyze("c")
    episodes = walk_episodes(assumed, 200, 60, np.random.default_rng(1))
    report = MeasuredReport(assumed, count_transitions(episodes, assumed.nodes, 0, assumed.augmented.exit))
    assert 0.2 < report.success_rate < 0.8
    assert report.chain.expected_steps == pytest.approx(report.empirical_steps, rel=1e-9)


def test_empirical_reach_counts_episodes(measured):
    report, episodes = measured
    lengths = np.array([len(nodes) - 1 for nodes in episodes])
    times = np.array([0, 10, 50, 100, 10_000])
    np.testing.assert_allclose(report.empirical_reach(times), (lengths[:, None] <= times).mean(axis=0))
    error = np.sqrt(0.25 / len(episodes))
    assert np.abs(report.chain.reach_probability(times) - report.empirical_reach(times)).max() < 4 * error


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    assumed, rng = analyze("a"), np.random.default_rng(2)
    held = 0
    for _ in range(20):
        counts = count_transitions(walk_episodes(assumed, 60, 10_000, rng), assumed.nodes, 0, 4)
        _, low, high = MeasuredReport(assumed, counts, level=0.9, n_resamples=40).intervals["expected_steps"]
        held += low <= assumed.expected_steps <= high
    assert held >= 13  # 18 expected; fewer than 13 has a chance of one in four hundred, and the seed is fixed


def test_the_same_seed_gives_the_same_intervals(measured):
    report, _ = measured
    once, again, other = (
        MeasuredReport(report.assumed, report.counts, n_resamples=20, seed=seed).intervals for seed in (0, 0, 1)
    )
    assert once == again
    assert once != other


def test_nobody_escapes():
    assumed = analyze("a")
    report = MeasuredReport(assumed, count_transitions([[0, 0, 1], [0, 0, 0]], 5, 0, 4), n_resamples=5)
    assert report.empirical_steps == np.inf
    assert report.intervals["expected_steps"] == (np.inf, np.inf, np.inf)
    assert report.intervals["hitting_time"] == (np.inf, np.inf, np.inf)
    assert report.intervals["exit within 1000"] == (0, 0, 0)
    assert "nobody escaped" in str(report)


def test_a_measured_chain_answers_what_an_assumed_one_does(measured):
    report, _ = measured
    table = report.to_dict()
    assert table["measured"]["steps to key 2"]["value"] == report.chain.expected_steps_to("key 2")
    assert table["assumed"]["steps to key 2"] == report.assumed.expected_steps_to("key 2")
    assert table["expected_states"]["100"] == report.chain.expected_states(100)
    assert min(table["goal_sensitivity"]) == min(report.assumed.goal_sensitivity())
    # a node that nobody came to hangs together with nothing, and is no reason to refuse
    partly = MeasuredReport(analyze("b"), count_transitions([[0, 1, 3, 12]], 13, 0, 12))
    assert sum(edge.elasticity for edge in partly.chain.edge_sensitivity()) == pytest.approx(-1, rel=1e-9)


def test_moves_name_what_differs():
    assumed = analyze("a")
    report = MeasuredReport(assumed, count_transitions([[0, 1, 2, 3, 4]] * 3, 5, 0, 4), n_resamples=5)
    moves = {(move.source, move.target): move for move in report.moves()}
    odd = moves["key 1, all closed", "start, open 1"]
    assert (odd.assumed, odd.measured, odd.count) == (0, 1, 3)
    assert "3 of 12 steps took an edge that the assumed walk lacks" in str(report)


@pytest.mark.parametrize(
    ("trajectories", "message"),
    [
        ([], "no episodes at all"),
        ([[0, 1, 2], [0]], "episode 1 must be a row of at least two nodes"),
        ([[0, 7]], "nodes are 0 to 2; episode 0 holds 0 to 7"),
        ([[1, 2]], "episode 0 must begin at node 0"),
        ([[0, 2, 1]], "may be at the exit only at its end"),
        ([[0, 0.5]], "row of at least two nodes"),
    ],
)
def test_one_clear_message(trajectories, message):
    with pytest.raises(InputError, match=message):
        count_transitions(trajectories, n_nodes=3, start=0, exit_node=2)


def test_counts_of_another_graph_are_refused():
    counts = count_transitions([[0, 1, 2]], 3, 0, 2)
    with pytest.raises(InputError, match="over 3 nodes, but goal graph c has 9"):
        MeasuredReport(analyze("c"), counts)
    with pytest.raises(InputError, match="at least 2 resamples"):
        MeasuredReport(analyze("a"), count_transitions([[0, 4]], 5, 0, 4), n_resamples=1)
