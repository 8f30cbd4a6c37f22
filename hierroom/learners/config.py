"""Every choice of the learner that is a number."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hierroom.errors import InputError


@dataclass(frozen=True)
class PPOConfig:
    """Hyperparameters of recurrent PPO; `hierroom.learners.ppo` says where each one acts.

    Args:
        sequence_length: T, turns of one agent in one environment that are learned from in a row; the recurrent
            gradient goes as far.
        sequences_per_update: M, full sequences an update waits for; None: as many as there are environments.
        minibatches: parts into which an epoch splits the sequences; a sequence is never cut.
        epochs: passes over the data of an update.
        learning_rate: Adam's step size at the start of training.
        final_learning_rate_fraction: what is left of it at the end, linear in between: 1 is constant, 0 is annealed
            to nothing.
        adam_epsilon: added to Adam's root mean square.
        max_gradient_norm: the gradient of all parameters together is shortened to this length.
        clip: how far the probability ratio may leave 1 before the objective goes flat.
        value_weight: weight of the value loss, which is half the mean squared error.
        entropy_weight: weight of the entropy bonus, in nats over the legal actions.
        gamma: discount per primitive step.
        gae_lambda: weight of longer advantage estimates, per turn.
        normalize_advantages: give the advantages of each minibatch mean 0 and standard deviation 1.
        min_advantage_std: smallest standard deviation advantages are divided by, so that noise is not blown up:
            without it flat PPO, rewarded only at the exit, had not learned even graph a after 3M steps (one seed; with
            it 100%).
        hidden_size: units of encoder and recurrent core.

    Raises:
        InputError: if a value is outside its range.
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
