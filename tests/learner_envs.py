"""Made-up environments for tests of the learner: everything random, uneven turns, every kind of end."""

import numpy as np
import torch

from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.ppo import Learner

# Networks this small gain nothing from torch's threads and lose a lot to them where another process is busy.
torch.set_num_threads(1)

SPACE = AgentSpace((5, 3, 7, 2), 4)


class PlainTorchNetwork(RecurrentActorCritic):
    """The default network under another name: the learner treats it as a user's, on the plain torch path."""


def make_learner(num_envs=6, network=None, seed=1, threads=1, **config):
    settings = {"sequence_length": 5, "minibatches": 2, "hidden_size": 8} | config
    return Learner(SPACE, num_envs, PPOConfig(**settings), seed=seed, network=network, threads=threads)


class RandomEnvs:
    """Random observations, masks, rewards and ends; each environment takes part in a tick with its own probability."""

    def __init__(self, num_envs, seed, space=SPACE):
        self.random = np.random.default_rng(seed)
        self.space = space
        self.num_envs = num_envs
        self.pace = np.linspace(0.3, 1.0, num_envs)
        self.features = self.draw_features(num_envs)

    def draw_features(self, n):
        return self.random.integers(0, self.space.cardinalities, (n, self.space.n_features)).astype(np.uint8)

    def draw_masks(self, n):
        masks = self.random.random((n, self.space.n_actions)) < 0.5
        masks[np.arange(n), self.random.integers(0, self.space.n_actions, n)] = True
        return masks

    def begin(self, learner):
        envs = np.flatnonzero(self.random.random(self.num_envs) < self.pace)
        masks = self.draw_masks(len(envs))
        return envs, masks, learner.act(envs, self.features[envs], masks)

    def finish(self, learner, envs):
        n = len(envs)
        end = self.random.random(n)
        terminated, truncated = end < 0.1, (end >= 0.1) & (end < 0.2)
        ended = terminated | truncated
        episode_ended = ended & (self.random.random(n) < 0.6)
        final = self.draw_features(n)
        rewards, elapsed = self.random.normal(size=n), self.random.integers(1, 4, n)
        learner.finish(envs, rewards, elapsed, terminated, truncated, episode_ended, final[truncated])
        self.features[envs] = np.where(ended[:, None], self.draw_features(n), final)
        if not learner.ready:
            return None
        waiting = np.flatnonzero(~learner.has_begun)
        learner.bootstrap(waiting, self.features[waiting])
        return learner.update(0.5)

    def tick(self, learner):
        envs, masks, actions = self.begin(learner)
        return envs, masks, actions, self.finish(learner, envs)
