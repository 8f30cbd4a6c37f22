"""Hyperparameters of the learner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from hierroom.support.errors import InputError
from hierroom.support.typed_value import Fraction, NotNegative, Positive, check_entries

PictureNetwork = Literal["small", "nature", "impala"]
_Count = Annotated[int, Meta(ge=1, le=2**20)]
"""A whole number with a bound beyond any practical use, but safe in 64-bit arithmetic."""


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
        hidden_size: units of each layer, at least 1.
        memory: lstm, or none for a network that acts on the current observation alone. Use none unless the observations
            of a task hide what its best actions depend on.
        pictures: the network that reads pictures: small; nature (Mnih et al. 2015); or impala (Espeholt et al. 2018).
        scale_observations: whether each number of an observation has a scale of its own: its bounds, or else the mean
            and deviation of the turns so far.
        scale_returns: whether rewards are divided by the running deviation of their discounted returns, so that their
            scale does not matter.
    """

    sequence_length: _Count = 32
    sequences_per_update: _Count | None = None
    minibatches: _Count = 4
    epochs: _Count = 4
    learning_rate: Positive = 1e-3
    final_learning_rate_fraction: Fraction = 1.0
    adam_epsilon: Positive = 1e-5
    max_gradient_norm: Positive = 0.5
    clip: Positive = 0.2
    value_weight: NotNegative = 1.0
    entropy_weight: NotNegative = 0.01
    gamma: Fraction = 0.95
    gae_lambda: Fraction = 0.95
    normalize_advantages: bool = True
    min_advantage_std: Positive = 0.1
    hidden_size: Annotated[int, Meta(ge=1, le=2**16)] = 64
    memory: Literal["lstm", "none"] = "lstm"
    pictures: PictureNetwork = "small"
    scale_observations: bool = False
    scale_returns: bool = False

    def __post_init__(self) -> None:
        check_entries(self)
        if self.memory == "lstm" and (self.sequences_per_update or self.minibatches) < self.minibatches:
            few = f"{self.sequences_per_update} sequences_per_update"
            raise InputError(f"each of the {self.minibatches} minibatches needs a sequence; there are {few}")

    def learning_rate_at(self, progress: float) -> float:
        """Return Adam's step size when a fraction of training, from 0 to 1, is done."""
        return self.learning_rate * (1 + progress * (self.final_learning_rate_fraction - 1))
