"""The compiled kernels against torch: gradients in float64, whole updates in float32."""

from copy import deepcopy

import numpy as np
import pytest
import torch
from learner_envs import SPACE, PlainTorchNetwork, RandomEnvs, make_learner
from torch.nn.utils import parameters_to_vector

from hierroom.learners.config import PPOConfig
from hierroom.learners.distributions import Categorical
from hierroom.learners.fused.adam_kernels import adam_step, norm, norm_of_blocks, sum_gradients
from hierroom.learners.fused.encoder_kernels import (
    compare_rows,
    complete_table,
    encode,
    encode_backward,
    encode_rare,
    most_common,
    rare_rows,
)
from hierroom.learners.fused.loss_kernels import heads, loss_backward
from hierroom.learners.fused.network import Parameters
from hierroom.learners.fused.recurrent_kernels import lstm_backward, lstm_forward
from hierroom.learners.fused.shard_worker import tape_memory
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.recurrent import ResetLSTM
from hierroom.learners.ppo import Learner
from hierroom.learners.torch_backend import ppo_loss

RANDOM = np.random.default_rng(0)


def close(found, expected, tolerance=1e-6):
    expected = expected.detach().numpy() if isinstance(expected, torch.Tensor) else expected
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance)


def normal(*shape):
    return RANDOM.normal(size=shape)


@pytest.mark.parametrize("cardinalities", [(5, 3, 1, 7, 2, 256), (5, 3, 1, 7, 2, 4, 6, 3, 2, 5, 4, 1, 3, 2, 6, 7, 256)])
def test_encoder_kernels_match_torch_gradients(cardinalities):
    n_features = len(cardinalities)
    network = RecurrentActorCritic(AgentSpace(cardinalities, 2), 10).double()
    features = RANDOM.integers(0, cardinalities, (150, n_features)).astype(np.uint8)
    table, offsets = network.encoder.weight.detach().numpy(), network.encoder.offsets.numpy()
    bias = network.encoder.bias.detach().numpy()
    bias += normal(10) / 10
    encoded = np.zeros((150, 13))  # wider than needed, as in use
    encode(features, offsets, table, bias, encoded, True)
    expected = network.encoder(torch.from_numpy(features))
    close(encoded[:, :10], expected)
    common, differences, base = most_common(features), np.empty((len(table) + 1, 10)), np.empty(10)
    used = np.zeros(len(table), bool)
    rows, counts = rare_rows(features, offsets, common, used)
    occurring = np.flatnonzero(used)
    np.testing.assert_array_equal(occurring, np.unique(features + offsets))
    assert rows.shape == (150, -(-n_features // 4) * 4)
    np.testing.assert_array_equal(counts, (features != common).sum(axis=1))
    compare_rows(table, bias, offsets, common, occurring, differences, base)
    encoded[...] = 0
    encode_rare(rows, counts, differences, base, encoded, True)
    close(encoded[:, :10], expected)
    d_encoded = normal(150, 13)
    expected.backward(torch.from_numpy(d_encoded[:, :10].copy()))
    d_table, d_bias = np.zeros_like(table), np.zeros(10)
    for half in (slice(70), slice(70, None)):
        encode_backward(rows[half], counts[half], encoded[half], d_encoded[half], d_table, d_bias, True)
    d_table[offsets + common] = 7.0  # to be overwritten
    complete_table(offsets, common, occurring, d_bias, d_table)
    close(d_table, network.encoder.weight.grad)
    close(d_bias, network.encoder.bias.grad)


@pytest.mark.parametrize(("n_table_rows", "dtype"), [(2**16 - 1, np.uint16), (2**16, np.uint32)])
def test_dtype_of_rare_rows_depends_on_table_size(n_table_rows, dtype):
    features, offsets = np.array([[0, 1, 1]], np.uint8), np.array([0, 2, n_table_rows - 2])
    rows, counts = rare_rows(features, offsets, np.zeros(3, np.uint8), np.zeros(n_table_rows, bool))
    assert rows.dtype == dtype
    assert rows.tolist() == [[3, n_table_rows - 1, n_table_rows, n_table_rows]]
    assert counts.tolist() == [2]


def test_most_common_finds_the_value_of_each_feature():
    features = np.array([[3, 0, 255], [3, 1, 255], [2, 1, 0], [3, 2, 255]], np.uint8)
    np.testing.assert_array_equal(most_common(features), [3, 1, 255])


@pytest.mark.parametrize(("n_turns", "n_rows", "size"), [(1, 3, 8), (9, 9, 8), (5, 4, 7)])
def test_lstm_kernels_match_torch_gradients(n_turns, n_rows, size):
    core = ResetLSTM(size, size).double()
    with torch.no_grad():
        core.bias.normal_(generator=torch.Generator().manual_seed(0))
    inputs, states = normal(n_turns, n_rows, size), normal(n_rows, 2 * size)
    resets = RANDOM.random((n_turns, n_rows)) < 0.3
    weight, bias = core.weight.detach().numpy(), core.bias.detach().numpy()
    driven, gates = np.concatenate([inputs, inputs], 2), np.empty((n_turns, n_rows, 4 * size))
    cells, squashed, hidden = (np.empty((n_turns + extra, n_rows, size)) for extra in (1, 0, 0))
    lstm_forward(driven, states, resets, weight, bias, gates, cells, squashed, hidden)
    leaf = torch.from_numpy(inputs).requires_grad_()
    expected = core.sequence(leaf, torch.from_numpy(states), torch.from_numpy(resets))
    close(hidden, expected)
    d_hidden = normal(n_turns, n_rows, size)
    expected.backward(torch.from_numpy(d_hidden.copy()))
    d_driven, d_weight, d_bias = np.empty_like(driven), np.ones_like(weight), np.ones_like(bias)
    lstm_backward(driven, resets, weight, gates, cells, squashed, d_hidden, d_driven, d_weight, d_bias)
    close(d_driven[:, :, :size], leaf.grad)
    close(d_weight - 1, core.weight.grad)
    close(d_bias - 1, core.bias.grad)


def test_loss_kernel_matches_torch_gradients():
    n, size, n_actions = 200, 6, 5
    config = PPOConfig(clip=0.2, value_weight=0.7, entropy_weight=0.3)
    policy, value = torch.nn.Linear(size, n_actions).double(), torch.nn.Linear(size, 1).double()
    weights = [p.detach().numpy() for p in (policy.weight, policy.bias, value.weight, value.bias)]
    hidden, advantages, targets = normal(n, size), normal(n), normal(n)
    masks = RANDOM.random((n, n_actions)) < 0.6
    actions = RANDOM.integers(0, n_actions, n)
    masks[np.arange(n), actions] = True
    logits, values = np.empty((n, n_actions)), np.empty(n)
    heads(hidden, hidden, *weights, logits, values)
    leaf = torch.from_numpy(hidden).requires_grad_()
    torch_logits, torch_values = policy(leaf), value(leaf)[:, 0]
    close(logits, torch_logits)
    close(values, torch_values)
    # Old log-probabilities near the new ones, so that some ratios are clipped on either side and some are not.
    legal = torch_logits.detach().masked_fill(~torch.from_numpy(masks), -1e9).log_softmax(-1).numpy()
    log_probs = legal[np.arange(n), actions] + 0.3 * normal(n)
    turns = masks, actions, log_probs, advantages, targets
    data = [torch.from_numpy(x)[None] for x in turns]
    loss, statistics = ppo_loss(torch_logits[None], torch_values[None], *data, config, Categorical())
    loss.backward()
    d_hidden, sums = np.empty((n, size)), np.zeros(5)
    gradients = [np.ones_like(w) for w in weights]
    scales = config.clip, config.value_weight, config.entropy_weight, 1 / n
    outputs, heads_weights = (hidden, hidden, logits, values), (weights[0], weights[2])
    loss_backward(*outputs, *heads_weights, *turns, *scales, d_hidden, d_hidden, *gradients, sums)
    assert 0.2 < sums[4] < 0.8
    close(sums, torch.stack(statistics))
    close(d_hidden, leaf.grad)
    for gradient, parameter in zip(gradients, (policy.weight, policy.bias, value.weight, value.bias), strict=True):
        close(gradient - 1, parameter.grad)


def test_backward_of_the_network_matches_torch():
    network = RecurrentActorCritic(SPACE, 16).double()
    vector = parameters_to_vector(network.parameters()).detach().numpy()
    weights, gradient = Parameters.views(vector, network), np.zeros_like(vector)
    features = RANDOM.integers(0, SPACE.cardinalities, (7, 10, 4)).astype(np.uint8)
    resets, states = RANDOM.random((7, 10)) < 0.2, normal(10, 32)
    memory, d_hidden = tape_memory(weights, network), normal(7, 10, 16)
    memory.tape(8, 12)
    tape = memory.tape(7, 10)
    table, offsets = weights.encoder_weight, network.encoder.offsets.numpy()
    encode(features.reshape(70, 4), offsets, table, weights.encoder_bias, tape.encoded, True)
    tape.forward(weights, states, resets)
    policy, value = (weights.policy_weight, weights.policy_bias), (weights.value_weight, weights.value_bias)
    heads(tape.policy_hidden, tape.value_hidden, *policy, *value, tape.logits, tape.values)
    tape.d_policy_hidden[...] = d_hidden.reshape(70, 16)
    parts = Parameters.views(gradient, network)
    common = np.zeros(4, np.uint8)
    used = np.zeros(len(table), bool)
    rows, counts = rare_rows(features.reshape(70, 4), offsets, common, used)
    used[offsets] = True  # of the common values
    tape.backward(weights, resets, parts)
    encode_backward(rows, counts, tape.encoded, tape.d_encoded, parts.encoder_weight, parts.encoder_bias, True)
    complete_table(offsets, common, np.flatnonzero(used), parts.encoder_bias, parts.encoder_weight)
    inputs = [torch.from_numpy(x) for x in (features, states, resets)]
    logits, values = network.sequence(*inputs)
    close(tape.logits.reshape(7, 10, 4), logits)
    close(tape.values.reshape(7, 10), values)
    network.core.sequence(network.encoder(inputs[0]), *inputs[1:]).backward(torch.from_numpy(d_hidden))
    heads_from = sum(p.numel() for p in [*network.encoder.parameters(), *network.core.parameters()])
    grads = [p.grad for p in (*network.encoder.parameters(), *network.core.parameters())]
    close(gradient[:heads_from], torch.cat([g.ravel() for g in grads if g is not None]))


def test_adam_steps_like_torch():
    parameter = torch.nn.Parameter(torch.from_numpy(normal(50)))
    adam = torch.optim.Adam([parameter], lr=0.01, eps=1e-5)
    found, means, squares = parameter.detach().numpy().copy(), np.zeros(50), np.zeros(50)
    blocks = np.array([[0, 7], [7, 20], [33, 50]])
    for step in range(1, 6):
        shares = normal(3, 50) * 10**-step
        shares[:, 20:33] = 0  # no gradient ever
        parameter.grad = torch.from_numpy(shares.sum(0))
        expected_norm = torch.nn.utils.clip_grad_norm_([parameter], 0.5)
        adam.step()
        sum_gradients(shares, blocks)
        found_norm = norm_of_blocks(shares[0], blocks)
        close([found_norm, norm(shares[0])], [expected_norm.item()] * 2)
        adam_step(found, shares[0], means, squares, blocks, min(1, 0.5 / (found_norm + 1e-6)), 0.01, 1e-5, step)
        close(found, parameter, 1e-10)


def with_numbers(base):
    """A network class for which two numbers stand for each value of its second feature."""
    vectors = [None, [[0.0, 1.0], [0.5, -1.0], [2.0, 0.0]], None, None]
    return lambda space, hidden_size: base(space, hidden_size, feature_vectors=vectors)


@pytest.mark.parametrize("wrap", [lambda base: base, with_numbers], ids=["rows", "numbers"])
def test_compiled_and_torch_updates_agree(wrap):
    learners = [make_learner(network=wrap(base)) for base in (RecurrentActorCritic, PlainTorchNetwork)]
    envs = [RandomEnvs(6, seed=1) for _ in learners]
    updates = 0
    while updates < 3:
        turns = [env.tick(learner) for env, learner in zip(envs, learners, strict=True)]
        np.testing.assert_array_equal(turns[0][2], turns[1][2])
        if turns[0][3]:
            updates += 1
            assert turns[0][3] == pytest.approx(turns[1][3], rel=1e-3, abs=1e-5)
    compiled, plain = (parameters_to_vector(learner.network.parameters()).detach() for learner in learners)
    # Adam divides by the size of the gradient, so a parameter with almost none moves by rounding errors.
    assert (compiled - plain).abs().median() < 1e-6
    assert (compiled - plain).abs().max() < 1e-3


@pytest.mark.parametrize("begun", [RecurrentActorCritic, PlainTorchNetwork])
def test_kernels_and_torch_load_each_others_state(begun):
    learner, env = make_learner(network=begun), RandomEnvs(6, seed=1)
    while not env.tick(learner)[3]:
        pass
    weights = []
    for network in (RecurrentActorCritic, PlainTorchNetwork):
        after, envs = make_learner(network=network, seed=5), deepcopy(env)
        after.load_state_dict(learner.state_dict())
        while not envs.tick(after)[3]:
            pass
        weights.append(parameters_to_vector(after.network.parameters()).detach())
    assert not torch.equal(weights[0], parameters_to_vector(learner.network.parameters()))
    assert (weights[0] - weights[1]).abs().median() < 1e-6
    assert (weights[0] - weights[1]).abs().max() < 1e-3


def test_skipping_rows_without_gradient_changes_nothing():
    space, config = AgentSpace((250, 7, 90), 3), PPOConfig(sequence_length=5, minibatches=2, hidden_size=8)
    learners = [Learner(space, 6, config, seed=1) for _ in range(3)]
    learners[1]._backend._used[:] = True
    envs = [RandomEnvs(6, seed=1, space=space) for _ in learners]
    n_used = []
    for share in (1, 2, 3):  # of the values of the large features
        for learner, env in zip(learners, envs, strict=True):
            env.space = AgentSpace((80 * share, 7, 30 * share), 3)
            while not env.tick(learner)[3]:
                pass
        n_used.append([len(learner._backend._blocks()) for learner in learners])
        saved = learners[2].state_dict()
        learners[2] = Learner(space, 6, config, seed=5)
        learners[2].load_state_dict(saved)
    sparse, dense, loaded = (parameters_to_vector(learner.network.parameters()) for learner in learners)
    assert torch.equal(sparse, dense)
    assert torch.equal(sparse, loaded)
    assert n_used[0][0] < n_used[-1][0] < n_used[-1][1] == len(range(0, 347, 16)) + 1
    assert [of[0] for of in n_used] == [of[2] for of in n_used]


@pytest.mark.parametrize(("num_envs", "many"), [(6, 2), (600, 2), (2400, 9)])
def test_the_number_of_threads_changes_nothing(num_envs, many):
    states = []
    for threads in (1, many):
        config = PPOConfig(sequence_length=4, minibatches=2, hidden_size=8)
        learner, envs = Learner(SPACE, num_envs, config, seed=3, threads=threads), RandomEnvs(num_envs, seed=3)
        for _ in range(30):
            envs.tick(learner)
        states.append(parameters_to_vector(learner.network.parameters()))
    assert torch.equal(*states)


def test_weights_loaded_into_the_network_are_used():
    learner, other = make_learner(seed=1), make_learner(seed=2)
    learner.network.load_state_dict(other.network.state_dict())
    features, states = np.ones((3, 4), np.uint8), np.zeros((3, 16), np.float32)
    np.testing.assert_array_equal(learner._backend.step(features, states)[1], other._backend.step(features, states)[1])


def test_adam_moments_without_gradient_reach_zero():
    parameters, means, squares = (np.full(3, value, np.float32) for value in (0, 1e-3, 5e-37))
    for step in range(1, 2001):
        adam_step(parameters, np.zeros(3, np.float32), means, squares, np.array([[0, 3]]), 1.0, 1e-3, 1e-5, step)
    assert (means == 0).all()
    assert (squares == 0).all()
