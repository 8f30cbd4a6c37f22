"""Made-up rooms for tests of the learner: everything random, uneven turns, every kind of end."""

import numpy as np
import torch

from hierroom.learners import AgentSpace, Learner, PPOConfig, RecurrentActorCritic

# Networks this small gain nothing from torch's threads and lose a lot to them where another process is busy.
torch.set_num_threads(1)

SPACE = AgentSpace((5, 3, 7, 2), 4)


class PlainTorchNetwork(RecurrentActorCritic):
    """The network that ships under another name: to the learner a user's own, so it takes the plain torch path."""


def make_learner(n_rooms=6, network=None, seed=1, **config):
    settings = {"sequence_length": 5, "minibatches": 2, "hidden_size": 8} | config
    return Learner(SPACE, n_rooms, PPOConfig(**settings), seed=seed, network=network)


class RandomRooms:
    """Random observations, masks, rewards and ends; a room acts in a tick with its own probability."""

    def __init__(self, n_rooms, seed, space=SPACE):
        self.random = np.random.default_rng(seed)
        self.space = space
        self.n_rooms = n_rooms
        self.pace = np.linspace(0.3, 1.0, n_rooms)
        self.codes = self.draw_codes(n_rooms)

    def draw_codes(self, n):
        return self.random.integers(0, self.space.cardinalities, (n, self.space.n_columns)).astype(np.uint8)

    def draw_masks(self, n):
        masks = self.random.random((n, self.space.n_actions)) < 0.5
        masks[np.arange(n), self.random.integers(0, self.space.n_actions, n)] = True
        return masks

    def begin(self, learner):
        """A turn begins in a random subset of the rooms; returns rooms, masks and actions."""
        rooms = np.flatnonzero(self.random.random(self.n_rooms) < self.pace)
        masks = self.draw_masks(len(rooms))
        return rooms, masks, learner.act(rooms, self.codes[rooms], masks)

    def finish(self, learner, rooms):
        """These turns end, and an update follows where one is due; returns its statistics or None."""
        n = len(rooms)
        end = self.random.random(n)
        terminated, truncated = end < 0.1, (end >= 0.1) & (end < 0.2)
        ended = terminated | truncated
        over = ended & (self.random.random(n) < 0.6)
        final = self.draw_codes(n)
        rewards, elapsed = self.random.normal(size=n), self.random.integers(1, 4, n)
        learner.finish(rooms, rewards, elapsed, terminated, truncated, over, final)
        self.codes[rooms] = np.where(ended[:, None], self.draw_codes(n), final)
        return learner.update(0.5) if learner.ready else None

    def tick(self, learner):
        """`begin` and `finish`; returns rooms, masks, actions and statistics."""
        rooms, masks, actions = self.begin(learner)
        return rooms, masks, actions, self.finish(learner, rooms)
