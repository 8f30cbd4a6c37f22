"""Hyperparameters of the learner."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hierroom.support.errors import InputError, require_number, use_python_numbers

MOST = {"sequence_length": 2**20, "minibatches": 2**20, "epochs": 2**20, "hidden_size": 2**16}
"""Upper bounds of whole numbers: beyond any practical use, but safe in 64-bit arithmetic."""


@dataclass(frozen=True)
class PPOConfig:
    """Hyperparameters of recurrent PPO; `hierroom.learners.ppo` explains where each one is used.

    Args:
        sequence_length: T, consecutive turns of one agent in one environment in a training sequence, at least 1.
        sequences_per_update: M, full sequences for an update, at least ``minibatches``; None: one per environment.
        minibatches: minibatches of whole sequences in each epoch, at least 1.
        epochs: passes over the data of an update, at least 1.
        learning_rate: Adam's step size at the start of training, above 0.
        final_learning_rate_fraction: the last update's learning rate as a fraction of ``learning_rate``, 0 to 1, with
            linear annealing in between; with 0 the last update learns nothing.
        adam_epsilon: constant added to the denominator of Adam's update, above 0.
        max_gradient_norm: clips the norm of the gradient of all parameters together, above 0.
        clip: clips the probability ratio to the interval from 1 - clip to 1 + clip, above 0.
        value_weight: weight of the value loss, which is half the mean squared error; at least 0.
        entropy_weight: weight of the entropy bonus, in nats over the legal actions; at least 0.
        gamma: discount per primitive step, 0 to 1.
        gae_lambda: lambda of generalised advantage estimation, applied per turn, 0 to 1.
        normalize_advantages: whether to normalise the advantages of each minibatch to mean 0 and deviation 1.
        min_advantage_std: lower bound of that deviation before normalising, above 0, so that noise is not amplified.
            Without it flat PPO had not learned graph a from the exit reward after 3M steps (one seed; with it 100%).
        hidden_size: units of the encoder and of the recurrent core, at least 1.
    """

    sequence_length: int = 32
    sequences_per_update: int | None = None
    minibatches: int = 4
    epochs: int = 4
    learning_rate: float = 1e-3
    final_learning_rate_fraction: float = 1.0
    adam_epsilon: float = 1e-5
    max_gradient_norm: float = 0.5
    clip: float = 0.2
    value_weight: float = 1.0
    entropy_weight: float = 0.01
    gamma: float = 0.95
    gae_lambda: float = 0.95
    normalize_advantages: bool = True
    min_advantage_std: float = 0.1
    hidden_size: int = 64

    def __post_init__(self) -> None:
        use_python_numbers(self)
        for name, high in MOST.items():
            require_number(name, getattr(self, name), 1, high, is_whole=True)
        if self.sequences_per_update is not None:
            require_number("sequences_per_update", self.sequences_per_update, 1, MOST["minibatches"], is_whole=True)
            if self.sequences_per_update < self.minibatches:
                few = f"{self.sequences_per_update} sequences_per_update"
                raise InputError(f"each of the {self.minibatches} minibatches needs a sequence; there are {few}")
        for name in ("learning_rate", "adam_epsilon", "max_gradient_norm", "clip", "min_advantage_std"):
            require_number(name, value := getattr(self, name), -math.inf)
            if value <= 0:
                raise InputError(f"{name} must be above 0, not {value}")
        for name in ("value_weight", "entropy_weight"):
            require_number(name, getattr(self, name), 0)
        for name in ("gamma", "gae_lambda", "final_learning_rate_fraction"):
            require_number(name, getattr(self, name), 0, 1)
        if not isinstance(self.normalize_advantages, bool):
            raise InputError(f"normalize_advantages must be True or False, not {self.normalize_advantages!r}")

    def learning_rate_at(self, progress: float) -> float:
        """Return Adam's step size when a fraction of training, from 0 to 1, is done."""
        return self.learning_rate * (1 + progress * (self.final_learning_rate_fraction - 1))
