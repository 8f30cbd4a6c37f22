"""A sequence ends with the bootstrap value of the agent's next observation."""

import io

import numpy as np
import pytest
import torch
from learner_envs import SPACE, PlainTorchNetwork, make_learner
from same_state import equal

from hierroom.support.errors import InputError

N, LENGTH = 4, 3
ENVS, EVERYTHING = np.arange(N), np.ones((N, 4), bool)
GOES_ON = np.array([True, False, False, True])
"""In their last turn the returns of environments 0 and 3 go on, that of 1 terminates and that of 2 is truncated."""

both_paths = pytest.mark.parametrize("network", [None, PlainTorchNetwork], ids=["compiled", "torch"])


def observations(seed):
    return np.random.default_rng(seed).integers(0, SPACE.cardinalities, (N, SPACE.n_features)).astype(np.uint8)


NEXT, LAST = observations(100), observations(101)


def take_turns(learner, n_turns, end=None):
    """Take turns in all environments; ``end``, if given, is terminated [N] and truncated [N] of the last turns."""
    none = np.zeros(N, bool)
    for t in range(n_turns):
        learner.act(ENVS, observations(t), EVERYTHING)
        terminated, truncated = end if end is not None and t == n_turns - 1 else (none, none)
        ended = terminated | truncated
        learner.finish(ENVS, np.full(N, t), np.ones(N, int), terminated, truncated, ended, LAST[truncated])


def filled(network, n_sequences=N, seed=1):
    learner = make_learner(N, network, seed, sequence_length=LENGTH, sequences_per_update=n_sequences)
    take_turns(learner, LENGTH, (ENVS == 1, ENVS == 2))
    values = learner._backend.step(np.where(ENVS[:, None] == 2, LAST, NEXT), learner._states)[1]
    return learner, np.where(ENVS == 1, 0, values)


def value_by(module, features, states):
    with torch.no_grad():
        return module.step(torch.from_numpy(features), torch.from_numpy(states))[1].numpy()


def check_same(network, found, expected):
    """Exactly the same; but torch's products round otherwise with other rows in the batch."""
    if network is None:
        np.testing.assert_array_equal(found, expected)
    else:
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)


def learned_from(learner):
    batches, train = [], learner._backend.train
    learner._backend.train = lambda batch, *rest: batches.append(batch) or train(batch, *rest)
    learner.update(0.0)
    learner._backend.train = train
    (batch,) = batches
    return batch


@both_paths
def test_bootstrap_and_act_give_equal_next_values(network):
    later, expected = filled(network)
    states = later._states.copy()
    np.testing.assert_allclose(value_by(later.network, NEXT, states)[GOES_ON], expected[GOES_ON], rtol=1e-5, atol=1e-6)
    later.bootstrap(ENVS, NEXT)
    by_bootstrap = learned_from(later)
    check_same(network, by_bootstrap.next_values[-1], expected)

    acting, same = filled(network, n_sequences=2 * N)
    np.testing.assert_array_equal(same, expected)
    acting.act(ENVS, NEXT, EVERYTHING)
    acting.finish(ENVS, np.zeros(N), np.ones(N, int), *np.zeros((3, N), bool))
    take_turns(acting, LENGTH - 1, np.array([[False], [True]]).repeat(N, axis=1))
    by_acting = learned_from(acting)  # the first four sequences are those that waited
    check_same(network, by_acting.next_values[-1, :N], expected)
    np.testing.assert_array_equal(by_acting.next_values[-1, :N][GOES_ON], by_acting.values[0, N:][GOES_ON])

    now = value_by(later.network, NEXT, states)
    assert (np.abs(now - expected)[GOES_ON] > 1e-4).all()  # the weights after the update give another value


@both_paths
def test_bootstrap_changes_no_state_and_draws_nothing(network):
    learner, _ = filled(network)
    before = learner.state_dict()
    learner.bootstrap(ENVS, NEXT)
    after = learner.state_dict()
    assert all(equal(before[name], after[name]) for name in before if name != "rollout")


@both_paths
def test_an_update_before_the_bootstrap_is_refused(network):
    learner, expected = filled(network)
    for envs in ([], [0], [1, 2]):  # 3 is still later
        learner.bootstrap(np.array(envs, int), NEXT[envs])
        assert learner.ready
        with pytest.raises(RuntimeError, match=r"before bootstrap\(\)"):
            learner.update(0.0)
    learner.bootstrap(np.array([3]), NEXT[[3]])
    check_same(network, learned_from(learner).next_values[-1], expected)


@both_paths
def test_ended_returns_need_no_bootstrap(network):
    learner = make_learner(N, network, sequence_length=LENGTH)
    take_turns(learner, LENGTH, (ENVS < 2, ENVS >= 2))
    next_values = learned_from(learner).next_values[-1]
    np.testing.assert_array_equal(next_values != 0, ENVS >= 2)


@both_paths
def test_truncated_turns_need_their_last_features(network):
    learner = make_learner(N, network, sequence_length=LENGTH)
    learner.act(ENVS, NEXT, EVERYTHING)
    terminated, truncated = ENVS == 1, ENVS > 0  # a turn that is both counts as terminated
    ends = np.zeros(N), np.ones(N, int), terminated, truncated, truncated
    before = learner.state_dict()
    with pytest.raises(InputError, match=r"^last_features must hold 2 rows, one per truncated turn, not None$"):
        learner.finish(ENVS, *ends)
    with pytest.raises(InputError, match=r"^features must have shape \(2, 4\), a row per environment, not \(3, 4\)$"):
        learner.finish(ENVS, *ends, LAST[truncated])
    assert equal(before, learner.state_dict())
    learner.finish(ENVS, *ends, LAST[2:])
    expected = value_by(learner.network, LAST[2:], learner._states[2:])  # with the states after the turn
    np.testing.assert_allclose(learner._rollout.slots.next_values[0, :N], [0, 0, *expected], rtol=1e-5, atol=1e-6)
    assert equal(before["states"], learner.state_dict()["states"])


@both_paths
@pytest.mark.parametrize("by", ["bootstrap", "act"])
def test_learner_saved_before_bootstrap_resumes_exactly(network, by):
    learner, expected = filled(network)
    file = io.BytesIO()
    torch.save(learner.state_dict(), file)
    file.seek(0)
    resumed = make_learner(N, network, seed=99, sequence_length=LENGTH)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    for one in (learner, resumed):
        with pytest.raises(RuntimeError, match=r"before bootstrap\(\)"):
            one.update(0.0)
        if by == "act":
            one.act(ENVS, NEXT, EVERYTHING)
        else:
            one.bootstrap(ENVS, NEXT)
        check_same(network, learned_from(one).next_values[-1], expected)
    assert equal(learner.state_dict(), resumed.state_dict())
