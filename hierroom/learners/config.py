"""Every choice of the learner that is a number."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hierroom.errors import InputError


@dataclass(frozen=True)
class PPOConfig:
    """Hyperparameters of recurrent PPO; `hierroom.learners.ppo` says where each one acts.

    Raises:
        InputError: if a value is outside its range.
    """

    sequence_length: int = 32
    """T, turns of one agent in one environment that are learned from in a row; the recurrent gradient reaches as far."""
    sequences_per_update: int | None = None
    """M, full sequences an update waits for; None: as many as there are environments."""
    minibatches: int = 4
    """Parts into which an epoch splits the sequences; a sequence is never cut."""
    epochs: int = 4
    """Passes over the data of an update."""
    learning_rate: float = 1e-3
    """Adam's step size at the start of training."""
    final_learning_rate_fraction: float = 1.0
    """What is left of it at the end, linear in between: 1 is constant, 0 is annealed to nothing."""
    adam_epsilon: float = 1e-5
    """Added to Adam's root mean square."""
    max_gradient_norm: float = 0.5
    """The gradient of all parameters together is shortened to this length."""
    clip: float = 0.2
    """How far the probability ratio may leave 1 before the objective goes flat."""
    value_weight: float = 1.0
    """Weight of the value loss, which is half the mean squared error."""
    entropy_weight: float = 0.01
    """Weight of the entropy bonus, in nats over the legal actions."""
    gamma: float = 0.95
    """Discount per primitive step."""
    gae_lambda: float = 0.95
    """Weight of longer advantage estimates, per turn."""
    normalize_advantages: bool = True
    """Give the advantages of each minibatch mean 0 and standard deviation 1."""
    min_advantage_std: float = 0.1
    """Smallest standard deviation advantages are divided by, so that noise is not blown up: without it flat PPO, paid
    only at the exit, had not learned even graph a after 3M steps (one seed; with it 100%)."""
    hidden_size: int = 64
    """Units of encoder and recurrent core."""

    def __post_init__(self) -> None:
        for name in ("sequence_length", "minibatches", "epochs", "hidden_size"):
            self._require(name, 1, math.inf)
        if self.sequences_per_update is not None:
            self._require("sequences_per_update", self.minibatches, math.inf)
        for name in ("learning_rate", "adam_epsilon", "max_gradient_norm", "clip", "min_advantage_std"):
            self._require(name, 0, math.inf)
            if getattr(self, name) == 0:
                raise InputError(f"{name} must be above 0")
        for name in ("value_weight", "entropy_weight"):
            self._require(name, 0, math.inf)
        for name in ("gamma", "gae_lambda", "final_learning_rate_fraction"):
            self._require(name, 0, 1)

    def _require(self, name: str, low: float, high: float) -> None:
        value = getattr(self, name)
        if not low <= value <= high:
            bound = f"at least {low}" if high == math.inf else f"from {low} to {high}"
            raise InputError(f"{name} must be {bound}, not {value}")
