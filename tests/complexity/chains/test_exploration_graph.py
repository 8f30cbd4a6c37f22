"""Chains of any exploration graph: networkx, matrices, trajectories, Gymnasium environments."""

import math
from dataclasses import replace

import gymnasium
import networkx as nx
import numpy as np
import pytest
import scipy.sparse as sp
import torch
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.complexity import (
    Chain,
    Reading,
    Walk,
    analyze,
    mean_first_passage_time,
    measure_env,
    measure_trajectories,
)
from hierroom.complexity.measures.mdp import check_horizon, graph_mdp
from hierroom.goals import enumerate_graphs
from hierroom.support.errors import InputError


class Corridor(gymnasium.Env):
    """Cells 0 to 4 in a row, the goal in the last; action 1 leads right, 0 left."""

    action_space = spaces.Discrete(2)
    observation_space = spaces.Discrete(5)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.cell = 0
        return self.cell, {}

    def step(self, action):
        self.cell = max(0, self.cell + (1 if action else -1))
        return self.cell, float(self.cell == 4), self.cell == 4, False, {}


def cell(env):
    return env.unwrapped.cell


def test_a_plain_graph_is_a_uniform_walk():
    chain = Chain.from_networkx(nx.path_graph(6), 0, 5)
    assert chain.expected_steps == pytest.approx(25)
    assert chain.labels == tuple("012345")
    assert chain.expected_steps_to("3") == pytest.approx(9)


def test_weights_are_probabilities_or_rates():
    graph = nx.DiGraph()
    graph.add_weighted_edges_from([("start", "middle", 0.25), ("middle", "end", 0.5)])
    assert Chain.from_networkx(graph, "start", "end").expected_steps == pytest.approx(4 + 2)
    assert Chain.from_networkx(graph, "start", "end", rates=True).expected_steps == pytest.approx(2)
    assert Chain.from_networkx(graph, "start", "end", weight=None).expected_steps == pytest.approx(2)
    counted = nx.MultiDiGraph([("a", "b"), ("a", "b"), ("a", "c"), ("c", "b")])
    assert Chain.from_networkx(counted, "a", "b").expected_steps == pytest.approx(1 + 1 / 3)


def test_nodes_of_a_matrix_have_names():
    chain = Chain.from_matrix(
        [[0, 1, 1], [1, 0, 0], [0, 0, 0]], "hall", "garden", ["hall", "cellar", "garden"], rates=True
    )
    assert chain.expected_steps == pytest.approx(3)
    assert repr(chain) == "<Chain: random walk on 3 nodes from hall to garden>"
    with pytest.raises(InputError, match="there is no node 'attic' among the 3 nodes"):
        Chain.from_matrix(np.eye(3), "attic", 1, ["hall", "cellar", "garden"])
    with pytest.raises(InputError, match="with rates=True"):
        Chain.from_matrix([[0, 2], [1, 0]], 0, 1)


def test_trajectories_by_hand():
    """a b (goal) after two steps; a a b b misses after three, so that b leads back to a."""
    played = measure_trajectories([["a", "b", "goal", "left out"], ["a", "a", "b", "b"]], "goal")
    assert played.chain.labels == ("a", "b", "goal")
    np.testing.assert_allclose(played.chain.weights.toarray(), [[1 / 3, 2 / 3, 0], [1 / 3, 1 / 3, 1 / 3], [0.01, 0, 0]])
    assert (played.episodes, played.success_rate) == (2, 0.5)
    assert played.counts.passages().tolist() == [2]
    assert played.empirical_steps == 2 + 3 + 1
    assert played.chain.expected_steps == pytest.approx(6)
    np.testing.assert_array_equal(played.empirical_reach([1, 2, 3, 4]), [0, 0.5, 0.5, np.nan])
    assert played.counts.triples.tolist() == [[0, 0, 1, 1], [0, 1, 1, 1], [0, 1, 2, 1]]  # not through the restart
    assert played.times == (2, 4, 8)


@settings(max_examples=30)
@given(
    st.lists(st.lists(st.integers(0, 3), min_size=1, max_size=12), min_size=1, max_size=8).filter(
        lambda walks: any(3 in walk for walk in walks)
    )
)
def test_the_mean_of_the_chain_is_the_observed_one_whatever_the_trajectories(walks):
    played = measure_trajectories([[0, *walk] for walk in walks], 3)
    assert played.chain.expected_steps == pytest.approx(played.empirical_steps)


def test_a_target_never_reached():
    played = measure_trajectories([["a", "b"]], "goal", may_miss=True)
    assert played.empirical_steps == played.chain.expected_steps == float("inf")
    assert "0.0% reached the exit, 'goal'" in str(played)
    assert "nobody escaped" in str(played)
    with pytest.warns(UserWarning, match="no episode reaches the target 5; nodes seen are '0', '1', '2'"):
        assert measure_env(Corridor(), cell, 5, lambda observation: 1, episodes=2, max_steps=9).success_rate == 0


@pytest.mark.parametrize(("second", "words"), [(4, "a node that is not the target"), (2, "not at 2 and 0")])
def test_an_episode_that_begins_elsewhere_is_refused_before_the_next_one(second, words):
    done = []
    with pytest.raises(InputError, match=words):
        measure_env(
            Corridor(),
            lambda env: second if cell(env) == 0 and done else cell(env),
            4,
            lambda observation: 1,
            episodes=9,
            progress=done.append,
        )
    assert done == [1]


def test_a_chain_of_counts_needs_a_label_for_each_node():
    played = measure_trajectories([["a", "b"]], "b")
    with pytest.raises(InputError, match="counts over 2 nodes need 2 labels, not 1"):
        replace(played, labels=("a",))
    with pytest.raises(InputError, match="level between 0 and 1"):
        replace(played, level=95)


def test_random_play_in_a_gymnasium_environment():
    """A walk that stays at the wall half of the time needs 4 * 5 steps; its nodes are Markov states."""
    done = []
    played = measure_env(Corridor(), cell, 4, episodes=400, seed=1, progress=done.append)
    assert played.success_rate == 1
    assert done == list(range(1, 401))
    mean, std = played.observed["expected_steps"], played.observed["std"]
    assert abs(played.chain.expected_steps - 20) < 4.5 * std.value / 20
    assert std.value == pytest.approx(played.chain.std, rel=0.2)
    assert mean.low < 20 < mean.high
    assert played.intervals["expected_steps"].low < 20 < played.intervals["expected_steps"].high
    assert not played.markov.is_rejected
    again = measure_env(Corridor(), cell, 4, episodes=400, seed=1)
    np.testing.assert_array_equal(played.counts.lengths, again.counts.lengths)
    assert again.to_dict() == played.to_dict()


def test_a_memory_is_seen():
    """Whoever came to the fork from the left goes right: the chain of places says that one in two turns back."""
    walks = [["left", "fork", "right", "goal"], ["left", "start", "left", "fork", "right", "goal"]] * 20
    walks += [["left", "start", "right", "fork", "left", "fork", "right", "goal"]] * 20
    played = measure_trajectories(walks, "goal")
    assert played.markov.is_rejected
    assert "play is NOT Markov" in str(played)
    assert played.chain.expected_steps == pytest.approx(np.mean([3, 5, 7]))
    assert "play is NOT Markov" in played._repr_html_()


def test_bad_input_is_one_line():
    half = nx.DiGraph()
    half.add_edge(0, 1, weight=0.5)
    half.add_edge(1, 0)
    words = nx.DiGraph()
    words.add_edge(0, 1, weight="much")
    twins = nx.DiGraph([(1, "1")])
    for attempt, message in (
        (lambda: Chain.from_networkx(nx.path_graph(3), 0, 7), "no node 7 among the 3 nodes 0, 1, 2"),
        (lambda: Chain.from_networkx(nx.path_graph("sab"), "s", "s"), "two nodes, but both are 's'"),
        (lambda: Chain.from_networkx(half, 0, 1), "1 of 2 have it"),
        (lambda: Chain.from_networkx(words, 0, 1), "must be a number"),
        (lambda: Chain.from_networkx(twins, 1, "1"), "two of them are called '1'"),
        (lambda: Chain.from_matrix([[0, 1], [1, 0]], 0, 2), "from 0 to 1"),
        (lambda: Chain.from_matrix([[0, 1], [1, 0]], 0, 1, ["a"]), "2 nodes need as many labels, not 1"),
        (lambda: measure_trajectories([], 1), "there is none"),
        (
            lambda: measure_trajectories([["hall", "garden"]], "gardn"),
            "no episode reaches the target 'gardn'; nodes seen ",
        ),
        (lambda: measure_trajectories([[1, 2]], 1), "at least one step"),
        (lambda: measure_trajectories([[0, 1], [2, 1]], 1), "begin at the same node, not at 2 and 0"),
        (lambda: measure_env(Corridor(), cell, 4, episodes=0), "at least one episode"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            attempt()
        assert "\n" not in str(caught.value)


class TwoArms(gymnasium.Env):
    """The left arm ends the episode in failure after two steps, the right one reaches the goal after three."""

    observation_space, action_space = gymnasium.spaces.Discrete(1), gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place, self.steps = "start", 0
        return 0, {}

    def step(self, action):
        self.steps += 1
        self.place = ("left", "right")[action] if self.steps == 1 else self.place
        ends = {"left": 2, "right": 3}
        has_ended = self.steps == ends[self.place]
        if has_ended and self.place == "right":
            self.place = "goal"
        return 0, 0.0, has_ended, False, {}


def test_an_episode_that_fails_never_escapes_and_one_that_is_truncated_may_have():
    played = measure_env(TwoArms(), lambda env: env.unwrapped.place, "goal", episodes=200)
    share = played.success_rate
    assert 0.3 < share < 0.7
    assert played.empirical_reach([2, 3, 1000]) == pytest.approx([0, share, share])
    assert not any("truncated" in note for note in played.notes())
    with pytest.warns(UserWarning, match="no episode reaches the target"):
        cut = measure_env(TwoArms(), lambda env: env.unwrapped.place, "goal", episodes=200, max_steps=1)
    assert np.isnan(cut.empirical_reach([2])).all(), "after one step nobody knows"
    walks = [["s", "x"], ["s", "t"]]
    assert np.isnan(measure_trajectories(walks, "t").empirical_reach([5])).all()
    assert measure_trajectories(walks, "t", failed=[True, False]).empirical_reach([5]) == [0.5]
    with pytest.raises(InputError, match="failed must say it of each of 2 episodes, not of 1"):
        measure_trajectories(walks, "t", failed=[True])


@pytest.mark.parametrize("n", [3, 6, 12, 24])
def test_a_target_that_is_never_left_has_no_hitting_time_of_the_paper(n):
    """Its value would be the steps spent at the start, n - 1, while the mean is (n - 1)^2."""
    line = nx.path_graph(n).to_directed()
    line.remove_edge(n - 1, n - 2)
    chain = Chain.from_networkx(line, 0, n - 1)
    assert chain.expected_steps == pytest.approx((n - 1) ** 2)
    assert chain.is_one_way()
    assert math.isnan(chain.hitting_time)
    assert all(math.isnan(edge.hitting_time_slope) for edge in chain.edge_sensitivity())
    assert math.isnan(chain.hitting_time_to("1")), "nor has a node on the way there"
    assert math.isnan(analyze("c", walk=Walk(0.8, 0.2, 0.0)).hitting_time)


@pytest.mark.parametrize("leak", [0, 1, 5])
def test_a_walk_that_may_never_come_back_has_no_hitting_time_of_the_paper(leak):
    """From the start, on the way or from the target: its value would be 5 again, the steps spent at the start."""
    line = nx.path_graph(6).to_directed()
    nx.add_cycle(line, ["elsewhere", "for ever"])
    assert math.isfinite(Chain.from_networkx(line, 0, 5).hitting_time)
    line.add_edge(leak, "elsewhere")
    assert math.isnan(Chain.from_networkx(line, 0, 5).hitting_time)


@pytest.mark.parametrize("drop_key", [False, True])
def test_the_papers_walk_on_a_graph_of_networkx_gives_the_papers_numbers(drop_key):
    report = analyze("c", drop_key)
    unrolled = report.augmented.to_networkx()
    unrolled.add_edge("exit", "start", weight=1.0)  # of a target only the restart counts
    unrolled.add_edge("start", "start", weight=0.5)  # and no edge from a node to itself
    chain = Chain.from_networkx(unrolled, "start", "exit", walk=Walk())
    assert (chain.hitting_time, chain.expected_steps) == pytest.approx((report.hitting_time, report.expected_steps))
    np.testing.assert_allclose(chain.weights.toarray(), report.chain.weights.toarray())


def test_the_papers_walk_divides_a_move_by_the_weights():
    """The start's edges weigh 1 + 1 and 2; the dead end has only the restart, and the target too."""
    graph = nx.MultiDiGraph([("s", "t"), ("s", "t"), ("s", "dead end"), ("t", "dead end")])
    chain = Chain.from_networkx(graph, "s", "t", walk=Walk(0.7, 0.2, 0.1))
    np.testing.assert_allclose(chain.weights.toarray(), [[0, 0.4 / 3, 0.2 / 3], [0.1, 0, 0], [0.1, 0, 0]])
    weighted = nx.DiGraph()
    weighted.add_weighted_edges_from([("s", "t", 3.0), ("s", "dead end", 1.0)])
    chain = Chain.from_networkx(weighted, "s", "t", walk=Walk(0.7, 0.2, 0.1))
    np.testing.assert_allclose(chain.weights.toarray(), [[0, 0.15, 0.05], [0.1, 0, 0], [0.1, 0, 0]])


def softmax_of_torch(n, dtype):
    return torch.softmax(torch.from_numpy(np.random.default_rng(0).normal(size=(n, n))).to(dtype), 1)


@pytest.mark.parametrize(
    "matrix",
    [
        np.full((6, 6), 1 / 6, np.float32),
        sp.csr_array(np.full((6, 6), 1 / 6, np.float32)),
        np.full((6, 6), 1 / 6).astype(np.float16),
        softmax_of_torch(500, torch.float32),
        softmax_of_torch(50, torch.float16),
    ],
)
def test_rows_may_exceed_one_by_the_rounding_of_their_dtype(matrix):
    chain = Chain.from_matrix(matrix, 0, 1)
    assert chain.weights.sum(axis=1).max() <= 1 + 1e-12
    assert chain.expected_steps == pytest.approx(
        mean_first_passage_time(np.float64(chain.weights.toarray()), 1)[0], rel=1e-6
    )
    assert Walk(*np.array([0.8, 0.19, 0.01], np.float32)).restart == pytest.approx(0.01)


def test_weights_of_edges_may_be_rounded_too():
    graph = nx.DiGraph()
    graph.add_weighted_edges_from([(0, j, np.float32(1 / 6)) for j in range(6)] + [(1, 0, np.float32(1))])
    assert Chain.from_networkx(graph, 0, 1).expected_steps == float("inf")


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.round(np.full((6, 6), 1 / 6), 4), r"row 0 of W sums to 1.0002 \(0.0002 too much\); divide"),
        (np.full((6, 6), 1 / 6) + 1e-8, r"row 0 of W sums to 1 \(6e-08 too much\)"),
        (np.full((6, 6), 1 / 6 + 1e-6, np.float32), r"row 0 of W sums to 1.00001 \(6.*e-06 too much\)"),
        (torch.full((2, 2), 0.5, requires_grad=True), "W must be a square matrix of numbers: Can't call numpy"),
    ],
)
def test_rows_that_exceed_one_by_more_say_by_how_much(matrix, message):
    with pytest.raises(InputError, match=message):
        Chain.from_matrix(matrix, 0, 1)


@pytest.mark.parametrize("is_list", [False, True])
def test_numbers_of_thousands_of_digits_are_one_clear_line(is_list):
    huge = [10**5000] if is_list else 10**5000
    chain = Chain.from_matrix([[0, 1], [1, 0]], 0, 1)
    for attempt in (
        lambda: chain.expected_steps_to(huge),
        lambda: chain.reach_probability(huge),
        lambda: mean_first_passage_time([[0, 1], [1, 0]], huge),
        lambda: Chain.from_networkx(nx.path_graph(3), huge, 1),
        lambda: Chain.from_matrix([[0, 1], [1, 0]], 0, 1, [huge, 1]),
        lambda: Walk(stay=huge),
        lambda: Reading(keys=huge),
        lambda: measure_trajectories([["a", "b"]], 10**5000),
        lambda: measure_trajectories([["a", "b"], [10**5000, "b"]], "b"),
        lambda: enumerate_graphs(huge if is_list else -huge),
        lambda: check_horizon(graph_mdp(analyze("a").augmented), huge),
    ):
        with pytest.raises(InputError) as caught:
            attempt()
        assert "\n" not in str(caught.value)
