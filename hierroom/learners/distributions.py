"""Turn the outputs of a policy into a distribution of actions, for each kind of actions."""

# `Categorical` documents the methods of all classes:
# ruff: noqa: D102
from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.sampling import greedy_actions, log_probabilities, sample_actions
from hierroom.support.errors import InputError

_ILLEGAL = -1e9  # finite, so that an illegal action's term in the entropy is 0 and not NaN
_LOG_ROOT = 0.5 * math.log(2 * math.pi)


class Categorical:
    """One of A actions: the softmax over the legal ones.

    Methods take outputs [N, A] and masks [N, A]; `evaluate` takes tensors with any axes before A.

    Attributes:
        shape, dtype: of one action as it is stored in turns.
        bounds: the smallest and the largest number of an action, None where there is none.
    """

    shape: tuple[int, ...] = ()
    dtype: Any = np.int64

    def __init__(self, n_actions: int | None = None) -> None:
        self.bounds: tuple[Any, Any] = 0, None if n_actions is None else n_actions - 1

    def zeros(self, *n: int) -> NDArray:
        """Return actions [*n, ...] as they are stored, all 0."""
        return np.zeros((*n, *self.shape), self.dtype)

    def noise(self, random: np.random.Generator, n: int) -> NDArray[np.float64]:
        """Draw the random numbers [n, ...] of which `sample` makes n actions."""
        return random.random(n)

    def sample(self, outputs: NDArray, masks: NDArray[np.bool_], noise: NDArray) -> tuple[NDArray, NDArray]:
        """Sample actions [N, ...], and return also their log-probabilities [N]."""
        return sample_actions(outputs, masks, noise)

    def greedy(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        """Return the most probable actions [N, ...]."""
        return greedy_actions(outputs, masks)

    def log_probs(self, outputs: NDArray, masks: NDArray[np.bool_], actions: NDArray) -> NDArray:
        """Return the log-probabilities [N] of actions [N, ...]."""
        return log_probabilities(outputs, masks, actions)

    def probabilities(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        """Return the probabilities [N, A]: the softmax over the legal actions, 0 elsewhere."""
        legal = np.where(masks, outputs, -np.inf)
        weights = np.exp(legal - legal.max(axis=-1, keepdims=True))
        return weights / weights.sum(axis=-1, keepdims=True)

    def evaluate(self, outputs: Tensor, masks: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Return log-probabilities and entropies [...] of actions [...], for the gradient."""
        log_policy = torch.log_softmax(outputs.masked_fill(~masks, _ILLEGAL), dim=-1)
        chosen = log_policy.gather(-1, actions.unsqueeze(-1)).squeeze(-1)
        return chosen, -(log_policy.exp() * log_policy).sum(-1)

    def are_legal(self, masks: NDArray[np.bool_], actions: NDArray) -> Any:
        """Return whether actions [..., *shape] are legal."""
        return np.take_along_axis(masks, actions[..., None], axis=-1)[..., 0]


class MultiCategorical(Categorical):
    """K independent softmaxes, one after the other in the outputs; there are no masks."""

    def __init__(self, sizes: tuple[int, ...]) -> None:
        counts = np.array(sizes)  # [K]
        self.shape, self.bounds = (len(sizes),), (0, counts - 1)
        places = np.arange(counts.max())
        self._exist = places < counts[:, None]  # [K, the most values]
        self._columns = np.where(self._exist, (np.cumsum(counts) - counts)[:, None] + places, 0)

    def _rows(self, outputs: NDArray) -> tuple[NDArray, NDArray[np.bool_]]:
        """Return outputs [N K, the most values] of single softmaxes, and which of them exist."""
        most = self._columns.shape[1]
        return outputs[:, self._columns].reshape(-1, most), np.tile(self._exist, (len(outputs), 1))

    def noise(self, random: np.random.Generator, n: int) -> NDArray[np.float64]:
        return random.random((n, *self.shape))

    def sample(self, outputs: NDArray, masks: NDArray[np.bool_], noise: NDArray) -> tuple[NDArray, NDArray]:
        actions, log_probs = sample_actions(*self._rows(outputs), noise.ravel())
        return actions.reshape(noise.shape), log_probs.reshape(noise.shape).sum(axis=1)

    def greedy(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        return greedy_actions(*self._rows(outputs)).reshape(-1, *self.shape)

    def log_probs(self, outputs: NDArray, masks: NDArray[np.bool_], actions: NDArray) -> NDArray:
        return log_probabilities(*self._rows(outputs), actions.ravel()).reshape(actions.shape).sum(axis=1)

    def probabilities(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        shares = super().probabilities(*self._rows(outputs)).reshape(len(outputs), *self._exist.shape)
        return shares[:, self._exist]

    def evaluate(self, outputs: Tensor, masks: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        columns, exist = (torch.from_numpy(each).to(outputs.device) for each in (self._columns, self._exist))
        log_probs, entropies = super().evaluate(outputs[..., columns], exist, actions)
        return log_probs.sum(-1), entropies.sum(-1)

    def are_legal(self, masks: NDArray[np.bool_], actions: NDArray) -> Any:
        return np.True_


class Gaussian(Categorical):
    """K independent normal distributions: the outputs are K means and then K logarithms of deviations.

    Actions are as drawn, without bounds; whoever acts scales and clips them.
    """

    dtype = np.float32

    def __init__(self, sizes: tuple[int, ...]) -> None:
        self.shape, self.bounds = (len(sizes),), (None, None)

    def noise(self, random: np.random.Generator, n: int) -> NDArray[np.float64]:
        return random.standard_normal((n, *self.shape))

    def sample(self, outputs: NDArray, masks: NDArray[np.bool_], noise: NDArray) -> tuple[NDArray, NDArray]:
        means, log_deviations = np.split(outputs, 2, axis=-1)
        with np.errstate(over="ignore"):  # an update reports a policy that has diverged
            actions = (means + np.exp(log_deviations) * noise).astype(self.dtype)
        return actions, self.log_probs(outputs, masks, actions)

    def greedy(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        return outputs[:, : self.shape[0]].astype(self.dtype)

    def log_probs(self, outputs: NDArray, masks: NDArray[np.bool_], actions: NDArray) -> NDArray:
        return self.evaluate(torch.from_numpy(outputs), torch.empty(0), torch.from_numpy(actions))[0].numpy()

    def probabilities(self, outputs: NDArray, masks: NDArray[np.bool_]) -> NDArray:
        raise InputError("actions within bounds have densities and no probabilities; read the logits of the decision")

    def evaluate(self, outputs: Tensor, masks: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        means, log_deviations = outputs.chunk(2, dim=-1)
        distances = (actions - means) * torch.exp(-log_deviations)
        log_probs = -(0.5 * distances.square() + log_deviations + _LOG_ROOT).sum(-1)
        return log_probs, (log_deviations + 0.5 + _LOG_ROOT).sum(-1)

    def are_legal(self, masks: NDArray[np.bool_], actions: NDArray) -> Any:
        return np.True_


def distribution_of(space: AgentSpace) -> Categorical:
    """Return the distribution of the actions of a space."""
    if space.kind == "discrete":
        return Categorical(space.n_actions)
    return (Gaussian if space.kind == "box" else MultiCategorical)(space.sizes)
