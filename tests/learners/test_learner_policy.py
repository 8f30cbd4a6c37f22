"""Policies: a learner's network that acts elsewhere, the initial state that it may learn, and what it remembers."""

from threading import Lock

import numpy as np
import pytest
import torch
from learner_envs import PlainTorchNetwork, RandomEnvs, make_learner
from torch import nn

from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.ppo import Learner


def test_policy_acts_like_the_learner_without_changing_it():
    learner, twin = make_learner(sequence_length=100), make_learner(sequence_length=100)
    policy = learner.policy(6, seed=0)
    policy._random = np.random.default_rng(0)
    learner._action_random, twin._action_random = np.random.default_rng(0), np.random.default_rng(0)
    features = RandomEnvs(6, seed=7).draw_features(6)
    envs, masks, none = np.arange(6), np.ones((6, 4), bool), np.zeros(6, bool)
    for turn in range(8):
        episode_ended = none if turn != 4 else envs == 2
        sampled = policy.act(envs, features, masks)
        actions = [agent.act(envs, features, masks) for agent in (learner, twin)]
        np.testing.assert_array_equal(actions[0], actions[1])
        np.testing.assert_array_equal(actions[0], sampled)
        for agent in (learner, twin):
            agent.finish(envs, np.zeros(6), np.ones(6, int), episode_ended, none, episode_ended)
        policy.reset(envs[episode_ended])


def test_act_greedily_takes_the_best_legal_action():
    learner = make_learner()
    with torch.no_grad():
        learner.network.policy_head.bias.copy_(torch.tensor([0.0, 3.0, 1.0, 2.0]))
    policy = learner.policy(2, seed=0)
    masks = np.array([[True] * 4, [True, False, True, True]])
    np.testing.assert_array_equal(policy.act_greedily(np.arange(2), np.zeros((2, 4), np.uint8), masks), [1, 3])


class Notes(PlainTorchNetwork):
    """Notes its mode in an attribute that is no weight."""

    def step(self, features, state):
        self.mode = self.training
        return super().step(features, state)


def test_policy_leaves_network_unchanged_and_uses_new_weights():
    """So that threads may act with the same weights at the same time."""
    learner = make_learner(network=Notes)
    policies = [learner.policy(2, seed=0) for _ in range(2)]
    asked = np.arange(2), np.zeros((2, 4), np.uint8), np.ones((2, 4), bool)
    for policy in policies:
        policy.act(*asked)
    assert not hasattr(learner.network, "mode")
    before = policies[0].decision.values
    with torch.no_grad():
        learner.network.value_head.bias += 1
    for policy in policies:
        policy.reset(np.arange(2))
        policy.act(*asked)
        np.testing.assert_allclose(policy.decision.values, before + 1, atol=1e-6)


def test_policy_uses_an_uncopyable_network_directly():
    learner = make_learner(network=Notes)
    learner.network.lock = Lock()
    learner.policy(2, seed=0).act(np.arange(2), np.zeros((2, 4), np.uint8), np.ones((2, 4), bool))
    assert learner.network.mode is False
    assert learner.network.training


class LearnsItsStart(PlainTorchNetwork):
    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        self.start = nn.Parameter(torch.zeros(1, super().initial_state(1).shape[1]))

    def initial_state(self, n):
        return self.start.expand(n, -1)

    def sequence(self, features, state, resets):
        outputs = []
        for t in range(len(features)):
            state = torch.where(resets[t].unsqueeze(-1), self.initial_state(len(state)), state)
            *output, state = self.step(features[t], state)
            outputs.append(output)
        logits, values = zip(*outputs, strict=True)
        return torch.stack(logits), torch.stack(values)


def test_episodes_begin_in_the_networks_current_initial_state():
    learner, envs = make_learner(network=LearnsItsStart), RandomEnvs(6, seed=1)
    for _ in range(200):
        envs.tick(learner)
    now = learner.network.start.detach().numpy()
    assert np.abs(now).max() > 1e-4, "it has learned"
    seen = []
    step = learner._backend.step
    learner._backend.step = lambda features, states: (seen.append(states.copy()), step(features, states))[1]
    learner._starts_episode[:] = True
    begun, _, _ = envs.begin(learner)
    np.testing.assert_array_equal(seen[0], np.repeat(now, len(begun), axis=0))


def test_playing_does_not_change_the_learned_initial_state():
    learner, envs = make_learner(network=LearnsItsStart), RandomEnvs(6, seed=1)
    for _ in range(50):
        envs.tick(learner)
    before = learner.network.start.detach().clone()
    policy = learner.policy(3, seed=0)
    features = np.zeros((3, learner.space.n_features), np.uint8)
    for _ in range(3):
        policy.act(np.arange(3), features, np.ones((3, learner.space.n_actions), bool))
    assert torch.equal(learner.network.start, before)
    assert len(np.unique(policy._states, axis=0)) == 1, "each environment has a row of its own, and these are alike"


LENGTH = 6
OF_CUES = AgentSpace((3, LENGTH), 2)


class Memoryless(nn.Module):
    def __init__(self, space, hidden_size):
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size)
        self.heads = nn.Linear(hidden_size, space.n_actions + 1)

    def initial_state(self, n):
        return torch.zeros(n, 1)

    def step(self, features, state):
        outputs = self.heads(self.encoder(features))
        return outputs[..., :-1], outputs[..., -1], state

    def sequence(self, features, state, resets):
        logits, values, _ = self.step(features, state)
        return logits, values


def success_rate(network, updates, seed=0, num_envs=32):
    """The share of the last ten updates' episodes that end with the cue (1 or 2) of their first turn."""
    config = PPOConfig(sequence_length=2 * LENGTH, hidden_size=16, learning_rate=0.01, gamma=0.95)
    learner = Learner(OF_CUES, num_envs, config, seed=seed, network=network)
    random = np.random.default_rng(seed)
    envs, masks, none = np.arange(num_envs), np.ones((num_envs, 2), bool), np.zeros(num_envs, bool)
    clocks, cues, rewarded = np.arange(num_envs) % LENGTH, random.integers(0, 2, num_envs), []

    def features():
        return np.stack([np.where(clocks == 0, 1 + cues, 0), clocks], axis=1).astype(np.uint8)

    done = 0
    while done < updates:
        actions = learner.act(envs, features(), masks)
        episode_ended = clocks == LENGTH - 1
        rewards = (episode_ended & (actions == cues)).astype(float)
        if done >= updates - 10:
            rewarded.extend(rewards[episode_ended])
        clocks = (clocks + 1) % LENGTH
        cues = np.where(episode_ended, random.integers(0, 2, num_envs), cues)
        learner.finish(envs, rewards, np.ones(num_envs, int), episode_ended, none, episode_ended)
        if learner.ready:
            learner.bootstrap(envs, features())
            learner.update(0.0)
            done += 1
    return np.mean(rewarded)


def test_a_recurrent_policy_remembers_the_cue():
    assert success_rate(None, updates=100) > 0.95


@pytest.mark.slow
def test_a_memoryless_policy_stays_at_chance():
    assert 0.4 < success_rate(Memoryless, updates=40) < 0.6
