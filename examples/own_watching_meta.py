"""A custom meta-controller that watches: it remembers goals given in vain this episode, and gives them last.

python -m hierroom train --meta own_watching_meta:OthersFirst --goal-mask existing --subgoal-horizon 50
"""

import numpy as np
import torch


class OthersFirst:
    """Gives a legal goal at random, but first those that were not given in vain yet since anything was achieved."""

    def __init__(self, num_envs):
        """For a number of environments."""
        self.failures = np.zeros((num_envs, 13), np.int64)

    @classmethod
    def for_training(cls, num_envs):
        """Make one for a training run."""
        return cls(num_envs)

    def for_play(self, num_envs, *, seed):
        """Make one for the environments of an evaluation."""
        return type(self)(num_envs)

    def reset(self, envs):
        """Forget: in these environments an episode begins."""
        self.failures[envs] = 0

    def observe(self, step, turns):
        """After every step of all environments, in training and in play."""
        self.failures[step.events >= 0] = 0  # what was in vain before may be possible now
        failed = step.timed_out & (step.goals >= 0)
        self.failures[failed, step.goals[failed]] += 1

    def choose(self, observations, legal, situation):
        """Return goal ids [M]; the situation's uniforms make the choice independent of the batch."""
        scores = situation.uniforms[:, :13] - self.failures[situation.envs]
        return np.where(legal, scores, -np.inf).argmax(axis=1)

    def state_dict(self):
        """Return what goes into checkpoints: tensors and plain types."""
        return {"failures": torch.from_numpy(self.failures.copy())}

    def load_state_dict(self, state):
        """Go back to what `state_dict` gave."""
        self.failures[:] = state["failures"].numpy()
