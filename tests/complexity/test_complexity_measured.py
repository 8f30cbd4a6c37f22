"""Chains counted from trajectories: hand-counted, against the walk they were drawn from, and their intervals."""

from itertools import groupby, permutations

import numpy as np
import pytest

from hierroom.complexity import analyze
from hierroom.complexity.observed import EpisodeCounts, markov_test, observed, wilson_interval
from hierroom.complexity.played_chain import PlayedChain
from hierroom.support.errors import InputError


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
    return PlayedChain.against(report, EpisodeCounts.of(episodes, report.nodes, 0, report.augmented.exit)), episodes


def test_count_transitions_by_hand():
    counts = EpisodeCounts.of([[0, 0, 1, 2], [0, 1, 1, 1]], n_nodes=3, start=0, end=2)
    assert counts.lengths.tolist() == [3, 3]
    assert counts.escaped.tolist() == [True, False]
    # the second episode was truncated at node 1: one transition back to the start
    assert counts.total().toarray().tolist() == [[1, 2, 0], [1, 2, 1], [0, 0, 0]]
    assert counts.total([2, 0]).toarray().tolist() == [[2, 2, 0], [0, 0, 2], [0, 0, 0]]


def test_measured_chain_recovers_the_assumed_walk(measured):
    report, _ = measured
    for name, interval in report.intervals.items():
        assert interval.low <= interval.value <= interval.high
        width = interval.high - interval.low
        assert abs(report.predictions[name] - interval.value) < width + 1e-6, name
        assert width < 0.4 * interval.value or name == "exit within 10"


def test_report_without_escapes_is_infinite():
    assumed = analyze("a")
    report = PlayedChain.against(assumed, EpisodeCounts.of([[0, 0, 1], [0, 0, 0]], 5, 0, 4), n_resamples=5)
    assert report.empirical_steps == np.inf
    for name in ("expected_steps", "hitting_time"):
        assert report.intervals[name].value == np.inf
        assert str(report.intervals[name]) == "none"
    value, low, high = report.intervals["exit within 1000"]
    assert (value, low) == (0, 0)
    assert high > 0.5  # 0 of 2 says little
    assert "nobody escaped" in str(report)


def test_measured_report_has_measured_and_assumed_numbers(measured):
    report, _ = measured
    table = report.to_dict()
    assert table["measured"]["steps to key 2"]["value"] == report.chain.expected_steps_to("key 2")
    assert table["assumed"]["steps to key 2"] == report.assumed.expected_steps_to("key 2")
    assert table["expected_states"]["100"] == report.chain.expected_states(100)
    assert min(table["goal_sensitivity"]) == min(report.assumed.goal_sensitivity())
    # a node without visits is isolated, and raises no error
    partly = PlayedChain.against(analyze("b"), EpisodeCounts.of([[0, 1, 3, 12]], 13, 0, 12))
    assert sum(edge.elasticity for edge in partly.chain.edge_sensitivity()) == pytest.approx(-1, rel=1e-9)


def test_moves_list_edges_missing_from_the_assumed_walk():
    assumed = analyze("a")
    report = PlayedChain.against(assumed, EpisodeCounts.of([[0, 1, 2, 3, 4]] * 3, 5, 0, 4), n_resamples=5)
    moves = {(move.source, move.target): move for move in report.moves()}
    odd = moves["key 1, all closed", "start, open 1"]
    assert (odd.assumed, odd.measured, odd.count) == (0, 1, 3)
    assert "3 of 12 steps took an edge that the assumed walk lacks" in str(report)


def test_counts_of_another_graph_raise_input_error():
    counts = EpisodeCounts.of([[0, 1, 2]], 3, 0, 2)
    with pytest.raises(InputError, match="over 3 nodes, but goal graph c has 9"):
        PlayedChain.against(analyze("c"), counts)
    with pytest.raises(InputError, match="resamples must be at least 2, not 1"):
        PlayedChain.against(analyze("a"), EpisodeCounts.of([[0, 4]], 5, 0, 4), n_resamples=1)


def test_nothing_is_observed_past_the_step_limit():
    assumed = analyze("c")
    episodes = walk_episodes(assumed, 100, 60, np.random.default_rng(3))
    report = PlayedChain.against(
        assumed, EpisodeCounts.of(episodes, assumed.nodes, 0, assumed.augmented.exit), n_resamples=5
    )
    assert report.counts.step_limit == 60
    reach = report.empirical_reach([10, 60, 61, 1000])
    assert np.isnan(reach).tolist() == [False, False, True, True]
    assert reach[1] == report.success_rate
    line = next(line.split() for line in str(report).splitlines() if line.startswith("  exit within 1000"))
    assert line[4] == "-"
    assert "truncated after 60 steps" in str(report)


def test_passages_go_on_through_truncated_episodes():
    """A geometric number of misses (three or four steps, with the restart) before an escape of two or one steps."""
    walks = [[0, 1, 2], [0, 1, 1, 1], [0, 2], [0, 1, 1], [0, 0, 2]]
    for order in permutations(walks):
        mean, std = EpisodeCounts.of(order, n_nodes=3, start=0, end=2).passage()
        misses, escapes, chance = np.array([4, 3]), np.array([2, 1, 2]), 3 / 5
        n_misses, its_variance = (1 - chance) / chance, (1 - chance) / chance**2
        assert mean == pytest.approx(n_misses * misses.mean() + escapes.mean())
        variance = n_misses * misses.var() + its_variance * misses.mean() ** 2 + escapes.var()
        assert std == pytest.approx(np.sqrt(variance * 3 / 2))


def test_few_or_equal_episodes_have_no_interval():
    assumed = analyze("a")
    alike = PlayedChain.against(assumed, EpisodeCounts.of([[0, 1, 3, 4]] * 12, 5, 0, 4))
    one = PlayedChain.against(assumed, EpisodeCounts.of([[0, 0, 0, 1, 3, 4]], 5, 0, 4))
    for report in (alike, one):
        for name, interval in (*report.intervals.items(), *report.observed.items()):
            if name.startswith("exit within"):
                assert interval.low < interval.high, name
            else:
                assert np.isnan([interval.low, interval.high]).all(), name
        assert "none: the episodes are too few, or too much alike" in str(report)


def test_intervals_of_times_cover_the_truth_of_truncated_walks():
    """A walk to cell 3 cut off after 12 steps; the truth is that of one set of a hundred thousand episodes."""
    rng, none = np.random.default_rng(0), np.zeros(0, np.int64)

    def play(n):
        cells, lengths = np.zeros(n, int), np.full(n, 12)
        for step in range(1, 13):
            moves = np.where(rng.random(n) < 0.5, 1, -1)
            cells = np.where(cells == 3, 3, np.maximum(0, cells + moves))
            lengths = np.where((cells == 3) & (lengths == 12), step, lengths)
        return EpisodeCounts(1, *[none] * 4, lengths, cells == 3, np.zeros((0, 4), np.int64))

    truth = dict(zip(("expected_steps", "std"), play(100_000).passage(), strict=True))
    found = [observed(play(30), (), 0.95, 200, rng) for _ in range(100)]
    for name, value in truth.items():
        assert sum(one[name].low <= value <= one[name].high for one in found) >= 88, name


def test_wilson_interval_by_hand():
    # 10 of 50 in the tables of Brown, Cai and DasGupta's formula, worked out by hand: z = 1.96, z^2 = 3.8415
    value, low, high = wilson_interval(0.2, 50, 0.95)
    assert (value, round(low, 4), round(high, 4)) == (0.2, 0.1124, 0.3304)
    assert wilson_interval(0.0, 300, 0.95).high == pytest.approx(3.8415 / 303.8415, rel=1e-4)
    assert wilson_interval(1.0, 300, 0.95).low == pytest.approx(300 / 303.8415, rel=1e-4)


def test_markov_test_accepts_the_assumed_walk():
    assumed, rng = analyze("a"), np.random.default_rng(5)
    tests = []
    for _ in range(100):
        counts = EpisodeCounts.of(walk_episodes(assumed, 40, 10_000, rng), assumed.nodes, 0, 4)
        tests.append(PlayedChain.against(assumed, counts).markov)
    chances = np.array([test.p_value for test in tests if test is not None])
    assert len(chances) == 100
    assert 0.4 < chances.mean() < 0.6  # uniform: 0.5, its standard error 0.03
    assert (chances < 0.05).sum() <= 12  # 5 expected
    assert (chances < 0.01).sum() <= 5


def test_markov_test_rejects_a_walk_with_memory():
    """Every stay lasts three steps exactly: the chain's mean is right, its deviation is not, and the test says so."""
    assumed, rng = analyze("a"), np.random.default_rng(6)
    episodes = [
        [node for node, _ in groupby(nodes[:-1]) for _ in range(3)] + nodes[-1:]
        for nodes in walk_episodes(assumed, 60, 10_000, rng)
    ]
    report = PlayedChain.against(assumed, EpisodeCounts.of(episodes, assumed.nodes, 0, 4), n_resamples=5)
    lengths = [len(nodes) - 1 for nodes in episodes]
    assert report.markov.is_rejected
    assert report.chain.std > 1.1 * report.observed["std"].value
    assert report.observed["expected_steps"].value == pytest.approx(np.mean(lengths))
    assert report.observed["std"].value == pytest.approx(np.std(lengths, ddof=1))
    assert report.chain.expected_steps == pytest.approx(np.mean(lengths), rel=1e-9)
    assert "play is NOT Markov" in str(report)
    assert report.to_dict()["markov_test"]["p_value"] < 1e-6


def test_markov_test_on_a_table_by_hand():
    # at node 1: from 0 to 2 30 times and to 3 10, from 4 10 and 30: chi-squared = 80 (30^2 - 10^2)^2 / 40^4 = 20
    triples = np.array([[0, 1, 2, 30], [0, 1, 3, 10], [4, 1, 2, 10], [4, 1, 3, 30], [2, 5, 0, 3], [3, 5, 2, 2]])
    statistic, degrees, p_value = markov_test(triples)
    assert (statistic, degrees) == (pytest.approx(20), 1)
    assert p_value == pytest.approx(7.744e-6, rel=1e-3)
    assert markov_test(triples[4:]) is None
    assert "too few steps to test" in str(PlayedChain.against(analyze("a"), EpisodeCounts.of([[0, 1, 3, 4]], 5, 0, 4)))
