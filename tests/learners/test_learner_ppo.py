"""The learner's promises, on the compiled and on the plain torch path alike."""

import io
from copy import deepcopy

import numpy as np
import pytest
import torch
from learner_envs import SPACE, PlainTorchNetwork, RandomEnvs, make_learner
from same_state import equal

from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.ppo import Learner
from hierroom.learners.torch_backend import TorchBackend
from hierroom.support.errors import InputError

both_paths = pytest.mark.parametrize("network", [None, PlainTorchNetwork], ids=["compiled", "torch"])


def recomputed_log_probs(network, batch):
    with torch.no_grad():
        logits, values = network.sequence(
            torch.from_numpy(batch.features), torch.from_numpy(batch.initial_states), torch.from_numpy(batch.resets)
        )
    policy = logits.masked_fill(~torch.from_numpy(batch.masks), -1e9).log_softmax(-1)
    return policy.gather(-1, torch.from_numpy(batch.actions)[..., None])[..., 0].numpy(), values.numpy()


@both_paths
def test_the_first_ratio_is_one_for_every_turn(network):
    learner = make_learner(network=network, sequences_per_update=11)
    envs = RandomEnvs(6, seed=2)
    with torch.no_grad():
        learner.network.policy_head.weight.normal_()  # far from uniform, so that agreement means something
    batches = []
    learner._backend.train = lambda batch, *rest: batches.append(batch) or np.zeros(6)  # ty: ignore
    while len(batches) < 3:
        envs.tick(learner)
    for batch in batches:
        assert batch.resets[1:].any(), "no episode began inside a sequence"
        log_probs, values = recomputed_log_probs(learner.network, batch)
        np.testing.assert_allclose(np.exp(log_probs - batch.log_probs), 1, atol=2e-6)
        np.testing.assert_allclose(values, batch.values, atol=2e-6)


@both_paths
def test_turns_of_earlier_weights_are_computed_again(network):
    """With few sequences an update most span updates, and still the ratios of all turns are 1."""
    learner = make_learner(network=network, sequences_per_update=2, learning_rate=0.05)
    envs, train = RandomEnvs(6, seed=2), learner._backend.train
    batches = []
    learner._backend.train = lambda batch, advantages, weights, *rest: (
        batches.append((batch, weights, *recomputed_log_probs(learner.network, batch)))
        or train(batch, advantages, weights, *rest)
    )  # ty: ignore
    taken, take = [], learner._rollout.take
    learner._rollout.take = lambda: taken.append(take()) or taken[-1]
    while len(batches) < 8:
        envs.tick(learner)
    n_old = 0
    for (batch, weights, log_probs, values), before in zip(batches, taken, strict=True):
        np.testing.assert_allclose(np.exp(log_probs - batch.log_probs), 1, atol=2e-6)
        np.testing.assert_allclose(values, batch.values, atol=2e-6)
        ratios = np.exp(log_probs - before.log_probs)
        np.testing.assert_allclose(weights, np.minimum(ratios, 1), atol=2e-6)
        is_old = np.abs(ratios - 1) > 0.01
        assert not is_old[:, ~before.spans_update].any()
        n_old += is_old.sum()
        goes_on = ~(batch.terminated | batch.truncated)
        np.testing.assert_allclose(batch.next_values[:-1][goes_on[:-1]], values[1:][goes_on[:-1]], atol=2e-6)
        np.testing.assert_array_equal(batch.next_values[~goes_on], before.next_values[~goes_on])
        np.testing.assert_array_equal(batch.next_values[-1], before.next_values[-1])
    assert n_old > 20, "no weights had changed: this shows nothing"


@both_paths
def test_a_turn_moves_only_its_own_environments(network):
    learner = make_learner(network=network, sequence_length=100)
    envs = RandomEnvs(6, seed=3)
    for _ in range(5):
        envs.tick(learner)
    before = learner.state_dict()["states"].clone()
    acting = np.array([1, 4])
    learner.act(acting, envs.features[acting], np.ones((2, 4), bool))
    after = learner.state_dict()["states"]
    others = [0, 2, 3, 5]
    assert torch.equal(after[others], before[others])
    assert not torch.isclose(after[acting], before[acting]).all(dim=1).any()


@both_paths
def test_no_masked_action_is_ever_sampled(network):
    learner = make_learner(network=network)
    envs = RandomEnvs(6, seed=4)
    for _ in range(100):
        _, masks, actions, _ = envs.tick(learner)
        assert masks[np.arange(len(actions)), actions].all()


@both_paths
def test_an_environment_without_a_legal_action_is_refused(network):
    learner = make_learner(network=network)
    masks = np.ones((6, 4), bool)
    masks[3] = False
    with pytest.raises(InputError, match="environment 3 has no legal action"):
        learner.act(np.arange(6), np.zeros((6, 4), np.uint8), masks)


@both_paths
@pytest.mark.parametrize("features", [[[0, 3, 0, 0]], [[0, 0, 0]], [[0, 0, 0, 0]] * 2])
def test_observations_of_another_space_are_refused(network, features):
    learner = make_learner(network=network)
    said = r"feature 1 must be below 3, but it is 3 in environment 5|features must have shape \(1, 4\), a row per env"
    with pytest.raises(InputError, match=said):
        learner.act(np.array([5]), np.array(features, np.uint8), np.ones((1, 4), bool))


@both_paths
def test_act_and_finish_take_zero_environments(network):
    learner = make_learner(network=network)
    policy = learner.policy(2, seed=0)
    none, nobody = np.zeros(0, bool), np.zeros(0, int)
    features, masks = np.zeros((0, 4), np.uint8), np.zeros((0, 4), bool)
    before = learner.state_dict()["action_random"]
    for act in (learner.act, policy.act, policy.act_greedily):
        assert act(nobody, features, masks).shape == (0,)
    learner.finish(nobody, np.zeros(0), nobody, none, none, none, features)
    assert learner.state_dict()["action_random"] == before


def test_disabled_jit_uses_the_torch_backend(monkeypatch):
    monkeypatch.setattr("numba.core.config.DISABLE_JIT", True)
    assert isinstance(make_learner()._backend, TorchBackend)


def test_act_and_finish_must_alternate():
    learner = make_learner()
    envs, features = np.arange(6), np.zeros((6, 4), np.uint8)
    none = np.zeros(6, bool)
    rest = (np.zeros(6), np.ones(6, int), none, none)
    with pytest.raises(RuntimeError, match="no turn has begun"):
        learner.finish(envs, *rest, none)
    learner.act(envs, features, np.ones((6, 4), bool))
    with pytest.raises(RuntimeError, match="last turn had finished"):
        learner.act(envs, features, np.ones((6, 4), bool))
    with pytest.raises(InputError, match="terminated or truncated"):
        learner.finish(envs, *rest, ~none)
    with pytest.raises(RuntimeError, match="ready"):
        learner.update(0.0)


@pytest.mark.parametrize(
    "network", [None, pytest.param(PlainTorchNetwork, marks=pytest.mark.slow)], ids=["compiled", "torch"]
)
@pytest.mark.parametrize("time_limit", [5, 50])
def test_values_do_not_depend_on_the_time_limit(network, time_limit):
    gamma, n = 0.8, 8
    config = PPOConfig(
        gamma=gamma, hidden_size=8, sequence_length=8, learning_rate=0.03, final_learning_rate_fraction=0.01
    )
    learner = Learner(AgentSpace((1,), 2), n, config, seed=0, network=network)
    envs, features, masks, none = np.arange(n), np.zeros((n, 1), np.uint8), np.ones((n, 2), bool), np.zeros(n, bool)
    clocks, updates, values = np.arange(n) % time_limit, 0, []
    while updates < 80:
        learner.act(envs, features, masks)
        clocks += 1
        late = clocks == time_limit
        clocks[late] = 0
        learner.finish(envs, np.ones(n), np.ones(n, int), none, late, late, features[late])
        if learner.ready:
            learner.bootstrap(envs, features)
            values = learner._rollout.slots.values.mean()
            learner.update(updates / 80)
            updates += 1
    assert values == pytest.approx(1 / (1 - gamma), rel=0.03)


class Exact(torch.nn.Linear):
    def forward(self, inputs):
        return super().forward(inputs.double()).float()


class PartlyDouble(PlainTorchNetwork):
    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        self.value_head = Exact(hidden_size, 1, dtype=torch.float64)


class RarelyUsed(PlainTorchNetwork):
    """A network with a parameter that gets no gradient from minibatches in which the first sequence does not reset."""

    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        self.offset = torch.nn.Parameter(torch.zeros(1))

    def sequence(self, features, state, resets):
        logits, values = super().sequence(features, state, resets)
        return logits, values + self.offset if resets[:, 0].any() else values


@pytest.mark.parametrize(
    "network",
    [None, PlainTorchNetwork, PartlyDouble, RarelyUsed],
    ids=["compiled", "torch", "two dtypes", "rare gradient"],
)
@pytest.mark.parametrize("ticks", [3, 37])
def test_learner_saved_within_a_turn_resumes_exactly(network, ticks):
    learner, envs = make_learner(network=network), RandomEnvs(6, seed=1)
    for _ in range(ticks):
        envs.tick(learner)
    begun, _, _ = envs.begin(learner)
    file = io.BytesIO()
    torch.save(learner.state_dict(), file)
    file.seek(0)
    resumed, envs_then = make_learner(network=network, seed=99), deepcopy(envs)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    envs.finish(learner, begun)
    envs_then.finish(resumed, begun)
    for _ in range(40):
        _, _, actions, statistics = envs.tick(learner)
        _, _, actions_after, statistics_after = envs_then.tick(resumed)
        assert (actions == actions_after).all()
        assert statistics == statistics_after
    assert equal(learner.state_dict(), resumed.state_dict())


def test_the_learning_rate_is_annealed_linearly():
    learner = make_learner(learning_rate=0.1, final_learning_rate_fraction=0.2)
    rates = []
    envs = RandomEnvs(6, seed=5)
    learner_update = learner.update
    for progress in (0.0, 0.5, 1.0):
        learner.update = lambda _, p=progress: learner_update(p)  # ty: ignore
        statistics = None
        while statistics is None:
            *_, statistics = envs.tick(learner)
        rates.append(statistics["learning_rate"])
    np.testing.assert_allclose(rates, [0.1, 0.06, 0.02])


def test_learner_draws_from_its_seed_and_no_global_generator():
    torch.manual_seed(0)
    np.random.seed(0)  # noqa: NPY002
    expected = torch.rand(1), np.random.rand()  # noqa: NPY002
    torch.manual_seed(0)
    np.random.seed(0)  # noqa: NPY002
    actions = []
    for seed in (7, 7, 8):
        learner, envs = make_learner(seed=seed), RandomEnvs(6, seed=6)
        actions.append(np.concatenate([envs.tick(learner)[2] for _ in range(60)]))
    assert (torch.rand(1), np.random.rand()) == expected  # noqa: NPY002
    np.testing.assert_array_equal(actions[0], actions[1])
    assert (actions[0] != actions[2]).any()


def test_wrong_spaces_and_networks_are_refused():
    with pytest.raises(InputError, match="features of 1 to 256"):
        AgentSpace((5, 257), 2)
    with pytest.raises(InputError, match="lacks initial_state"):
        Learner(SPACE, 8, PPOConfig(), seed=0, network=lambda space, hidden_size: torch.nn.Linear(1, 1))
    with pytest.raises(InputError, match="each of the 4 minibatches needs a sequence; there are 3"):
        Learner(SPACE, 3, PPOConfig(), seed=0)
    with pytest.raises(InputError, match=r"feature 1 has 3 values, so its vectors must have shape \[3, d\]"):
        RecurrentActorCritic(AgentSpace((2, 3), 2), 8, feature_vectors=[None, [[0.0], [1.0]]])
