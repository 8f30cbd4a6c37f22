"""Chains counted from trajectories in any exploration graph, and from play in Gymnasium environments."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.measures.mdp import enumerate_env
from hierroom.complexity import measure_env, measure_trajectories
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


def test_measure_trajectories_by_hand():
    """a b (goal) after two steps; a a b b misses after three, so that b leads back to a."""
    played = measure_trajectories([["a", "b", "goal", "left out"], ["a", "a", "b", "b"]], "goal")
    assert played.chain.labels == ("a", "b", "goal")
    np.testing.assert_allclose(played.chain.weights.toarray(), [[1 / 3, 2 / 3, 0], [1 / 3, 1 / 3, 1 / 3], [0.01, 0, 0]])
    assert (played.episodes, played.success_rate) == (2, 0.5)
    assert played.empirical_steps == 2 + 3 + 1
    assert played.counts.passage()[1] == np.inf, "one escape has no deviation"
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
def test_chain_mean_equals_observed_mean(walks):
    played = measure_trajectories([[0, *walk] for walk in walks], 3)
    assert played.chain.expected_steps == pytest.approx(played.empirical_steps)


def test_unreached_target_is_infinite_with_a_warning():
    played = replace(measure_trajectories([["a", "b"]], "goal", may_miss=True), n_resamples=5)
    assert played.empirical_steps == played.chain.expected_steps == float("inf")
    assert "0.0% reached the exit, 'goal'" in str(played)
    assert "nobody escaped" in str(played)
    with pytest.warns(UserWarning, match="no episode reaches the target 5; nodes seen are '0', '1', '2'"):
        assert measure_env(Corridor(), cell, 5, lambda observation: 1, episodes=2, max_steps=9).success_rate == 0


@pytest.mark.parametrize(("second", "words"), [(4, "a node that is not the target"), (2, "not at 2 and 0")])
def test_episode_with_another_start_raises_input_error(second, words):
    done = []

    def later(env):
        return second if cell(env) == 0 and done else cell(env)

    with pytest.raises(InputError, match=words):
        measure_env(Corridor(), later, 4, lambda observation: 1, episodes=9, progress=done.append)
    assert done == [1]


def test_measure_env_of_random_play():
    """A walk that stays at the wall half of the time needs 4 * 5 steps; its nodes are Markov states."""
    done = []
    played = measure_env(Corridor(), cell, 4, episodes=400, seed=2, progress=done.append)
    assert played.success_rate == 1
    assert done == list(range(1, 401))
    mean, std = played.observed["expected_steps"], played.observed["std"]
    assert abs(played.chain.expected_steps - 20) < 4.5 * std.value / 20
    assert std.value == pytest.approx(played.chain.std, rel=0.2)
    assert mean.low < 20 < mean.high
    assert played.intervals["expected_steps"].low < 20 < played.intervals["expected_steps"].high
    assert not played.markov.is_rejected
    again = measure_env(Corridor(), cell, 4, episodes=400, seed=2)
    np.testing.assert_array_equal(played.counts.lengths, again.counts.lengths)
    assert replace(again, n_resamples=20).to_dict() == replace(played, n_resamples=20).to_dict()


class Texting(Corridor):
    def step(self, action):
        return 0, 0.0, "False", False, {}


def test_wrong_results_of_an_environment_raise_input_error():
    """A text is true in Python, so that each episode would end after one step."""
    with pytest.raises(InputError, match="step of the environment must return True or False as terminated"):
        measure_env(Texting(), lambda env: 0, 1)
    with pytest.raises(InputError, match="step of the environment must return True or False as terminated"):
        enumerate_env(Texting(), lambda env: 0)


class Guess(Corridor):
    """The node after a step says whether the action equals a number that the environment drew."""

    def step(self, action):
        self.cell = "right" if action == self.np_random.integers(2) else "wrong"
        return 0, 0.0, False, False, {}


def test_random_actions_do_not_repeat_the_draws_of_the_environment():
    played = measure_env(Guess(), cell, "right", episodes=20, max_steps=1)
    assert 0.2 < played.success_rate < 0.8
    first = [measure_env(Guess(), cell, "right", episodes=1, max_steps=64, seed=n).counts.lengths[0] for n in range(20)]
    assert max(first) > 1, "guessed at once in 20 of 20 episodes"


class TwoArms(gymnasium.Env):
    """The left arm ends the episode in failure after two steps, the right one reaches the goal after three."""

    observation_space, action_space = spaces.Discrete(1), spaces.Discrete(2)

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


def test_reach_is_known_after_failure_unknown_after_truncation():
    played = replace(measure_env(TwoArms(), lambda env: env.unwrapped.place, "goal", episodes=200), n_resamples=5)
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


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (
            lambda: measure_trajectories([["hall", "garden"]], "gardn"),
            "no episode reaches the target 'gardn'; nodes seen ",
        ),
        (lambda: measure_trajectories([[1, 2]], 1), "at least one step"),
        (lambda: measure_trajectories([[0, 1], [2, 1]], 1), "begin at the same node, not at 2 and 0"),
        (
            lambda: measure_trajectories([["a", "b"]] * 2, "b", failed=[True]),
            "failed must have a value for each of 2 episodes, not a list",
        ),
        (
            lambda: measure_trajectories([["a", "b"]], "b", failed=True),
            "failed must have a value for each of 1 episodes",
        ),
        (
            lambda: measure_trajectories([[np.zeros(2), np.ones(2)]], (1, 1)),
            "a list of nodes such as texts, numbers or",
        ),
        (lambda: measure_env(Corridor(), cell, 4, episodes=0), "episodes must be at least 1, not 0"),
        (
            lambda: measure_env(Corridor(), lambda env: 1 / 0, 4, episodes=1),
            "fails: ZeroDivisionError: division by zero",
        ),
        (
            lambda: replace(measure_trajectories([["a", "b"]], "b"), labels=("a",)),
            "counts over 2 nodes need 2 labels, not 1",
        ),
        (lambda: replace(measure_trajectories([["a", "b"]], "b"), level=95), "level between 0 and 1"),
    ],
)
def test_invalid_trajectories_labels_and_levels_raise_input_error(attempt, message):
    with pytest.raises(InputError, match=message) as caught:
        attempt()
    assert "\n" not in str(caught.value)
