"""Sub-policies: each acts on its own symbol alone, and the bulk computation equals one turn at a time."""

import pytest
import torch

from hierroom.errors import InputError
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.modular import ModularActorCritic
from hierroom.learners.ppo import Learner

N_SYMBOLS, HIDDEN = 4, 8
SPACE = AgentSpace((N_SYMBOLS, 5, 3), 6)
SEEN = AgentSpace((5, 3), 6)


@pytest.fixture
def network():
    torch.manual_seed(0)
    return ModularActorCritic(SPACE, HIDDEN).double()


def features_of(*shape, seed=1):
    generator = torch.Generator().manual_seed(seed)
    of_numbers = [torch.randint(0, n, shape, generator=generator) for n in SPACE.cardinalities]
    return torch.stack(of_numbers, dim=-1).to(torch.uint8)


def test_a_sequence_is_turns_one_after_the_other(network):
    features, resets = features_of(7, 5), torch.rand(7, 5, generator=torch.Generator().manual_seed(2)) < 0.3
    state = torch.randn(5, 2 * HIDDEN, dtype=torch.float64)
    logits, values = network.sequence(features, state, resets)
    for t in range(7):
        state = torch.where(resets[t][:, None], network.initial_state(5), state)
        step_logits, step_values, state = network.step(features[t], state)
        torch.testing.assert_close(logits[t], step_logits)
        torch.testing.assert_close(values[t], step_values)


def test_each_environment_is_a_recurrent_actor_critic_of_its_symbol(network):
    features, state = features_of(9), torch.randn(9, 2 * HIDDEN, dtype=torch.float64)
    logits, values, states = network.step(features, state)
    for n in range(9):
        part = network.parts[features[n, 0]]
        assert isinstance(part, RecurrentActorCritic)
        expected = part.step(features[n : n + 1, 1:], state[n : n + 1])
        for found, right in zip((logits, values, states), expected, strict=True):
            torch.testing.assert_close(found[n : n + 1], right)


def test_a_symbol_teaches_its_own_sub_policy_and_no_other(network):
    features = features_of(4, 3)
    features[..., 0] = 2
    logits, values = network.sequence(features, network.initial_state(3), torch.zeros(4, 3).bool())
    (logits.sum() + values.sum()).backward()
    for symbol, part in enumerate(network.parts):
        taught = [p.grad is not None and bool(p.grad.any()) for p in part.parameters()]
        assert all(taught) if symbol == 2 else not any(taught)


def test_nobody_is_shown_the_symbol(network):
    assert all(part.encoder.offsets.shape == (SEEN.n_features,) for part in network.parts)
    for part in network.parts:
        part.load_state_dict(network.parts[0].state_dict())
    features = features_of(6)
    other = features.clone()
    other[:, 0] = (other[:, 0] + 1) % N_SYMBOLS
    state = network.initial_state(6)
    torch.testing.assert_close(network.step(features, state), network.step(other, state))


def test_vectors_for_values_reach_every_sub_policy():
    vectors = [None, torch.arange(10.0).reshape(5, 2).numpy(), None]
    network = ModularActorCritic(SPACE, HIDDEN, vectors)
    assert all(part.encoder.weight.shape == (2 + 3, HIDDEN) for part in network.parts)


def test_it_needs_something_to_see():
    with pytest.raises(InputError, match="something to see beside the symbol"):
        Learner(AgentSpace((4,), 3), 4, PPOConfig(), seed=0, network=ModularActorCritic)
