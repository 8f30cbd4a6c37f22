"""A task that cannot be solved without memory is solved, and a network without memory stays at chance."""

import numpy as np
import torch
from torch import nn

from hierroom.learners import AgentSpace, Learner, PPOConfig
from hierroom.learners.encoder import ColumnEncoder

LENGTH = 6
SPACE = AgentSpace((3, LENGTH), 2)


class Memoryless(nn.Module):
    """A user's own network that keeps the protocol and remembers nothing."""

    def __init__(self, space, hidden_size):
        super().__init__()
        self.encoder = ColumnEncoder(space.cardinalities, hidden_size)
        self.heads = nn.Linear(hidden_size, space.n_actions + 1)

    def initial_state(self, n):
        return torch.zeros(n, 1)

    def step(self, codes, state):
        outputs = self.heads(self.encoder(codes))
        return outputs[..., :-1], outputs[..., -1], state

    def sequence(self, codes, state, resets):
        logits, values, _ = self.step(codes, state)
        return logits, values


def success_rate(network, updates, seed=0, n_rooms=32):
    """Train in rooms that show a cue (1 or 2) in their first turn and pay 1 if the last action is the cue's.

    Returns the share of paid episodes among the last ten updates'.
    """
    config = PPOConfig(sequence_length=2 * LENGTH, hidden_size=16, learning_rate=0.01, gamma=0.95)
    learner = Learner(SPACE, n_rooms, config, seed=seed, network=network)
    random = np.random.default_rng(seed)
    rooms, masks, none = np.arange(n_rooms), np.ones((n_rooms, 2), bool), np.zeros(n_rooms, bool)
    clocks, cues, paid = np.arange(n_rooms) % LENGTH, random.integers(0, 2, n_rooms), []

    def codes():
        return np.stack([np.where(clocks == 0, 1 + cues, 0), clocks], axis=1).astype(np.uint8)

    done = 0
    while done < updates:
        actions = learner.act(rooms, codes(), masks)
        over = clocks == LENGTH - 1
        rewards = (over & (actions == cues)).astype(float)
        if done >= updates - 10:
            paid.extend(rewards[over])
        clocks = (clocks + 1) % LENGTH
        cues = np.where(over, random.integers(0, 2, n_rooms), cues)
        learner.finish(rooms, rewards, np.ones(n_rooms, int), over, none, over, codes())
        if learner.ready:
            learner.update(0.0)
            done += 1
    return np.mean(paid)


def test_a_recurrent_policy_remembers_the_cue():
    assert success_rate(None, updates=100) > 0.95


def test_a_memoryless_policy_stays_at_chance():
    assert 0.4 < success_rate(Memoryless, updates=60) < 0.6
