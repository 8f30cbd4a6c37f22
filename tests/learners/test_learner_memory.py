"""A task that cannot be solved without memory is solved, and a network without memory stays at chance."""

import numpy as np
import pytest
import torch
from torch import nn

from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.ppo import Learner

LENGTH = 6
SPACE = AgentSpace((3, LENGTH), 2)


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
    learner = Learner(SPACE, num_envs, config, seed=seed, network=network)
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
