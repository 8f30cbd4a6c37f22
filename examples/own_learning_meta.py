"""A custom meta-controller that learns which goals can be reached, while its controller learns to reach them.

python -m hierroom train --meta own_learning_meta:ReachedMostOften --goal-mask existing --subgoal-horizon 50
"""

import numpy as np
import torch

KEY, DOOR, DOOR_WITH_KEY, EXIT = range(4)
N_KINDS = 2 * (EXIT + 7)


def kinds_of(observations, seen):
    """Return the kind of each goal [M, 13]: key, door, door of a key held, exit behind so many doors; seen or not."""
    keys, doors = observations["keys_held"].astype(int), observations["doors_open"].astype(int)
    exits = EXIT + doors.sum(axis=1, keepdims=True)
    return 2 * np.concatenate([np.full_like(keys, KEY), DOOR + keys, exits], axis=1) + seen


class ReachedMostOften:
    """Gives a goal of the kind that was reached most often when it was given; one goal in ten at random."""

    def __init__(self, num_envs):
        """For a number of environments; every kind begins as if reached the one time it was tried."""
        self.tried, self.reached = np.ones(N_KINDS), np.ones(N_KINDS)
        self.given = np.zeros(num_envs, int)  # the kind of each environment's goal

    @classmethod
    def for_training(cls, num_envs):
        """Make one for a training run."""
        return cls(num_envs)

    def choose(self, observations, legal, situation):
        """Return goal ids [M]; the situation's uniforms make the choice independent of the batch."""
        kinds = kinds_of(observations, situation.levels["seen"][:, None] >> np.arange(13) & 1)
        uniforms, is_random = situation.uniforms[:, :13], situation.uniforms[:, 13:] < 0.1
        scores = np.where(is_random, uniforms, (self.reached / self.tried)[kinds] + 1e-6 * uniforms)
        goals = np.where(legal, scores, -1).argmax(axis=1)
        self.given[situation.envs] = kinds[np.arange(len(goals)), goals]
        return goals

    def learn(self, step):
        """Count the goals of the options that a primitive step ended, and those that were reached."""
        envs = np.flatnonzero(step.option_ended & (step.goals >= 0))
        np.add.at(self.tried, self.given[envs], 1)
        np.add.at(self.reached, self.given[envs], step.reached[envs])

    def for_play(self, num_envs, *, seed):
        """Return the same for other environments, to play and learn no more."""
        player = type(self)(num_envs)
        player.tried, player.reached = self.tried, self.reached
        return player

    def state_dict(self):
        """Return what goes into checkpoints: tensors and plain types."""
        return {name: torch.from_numpy(array.copy()) for name, array in vars(self).items()}

    def load_state_dict(self, state):
        """Go back to what `state_dict` gave."""
        for name, array in vars(self).items():
            array[:] = state[name].numpy()
