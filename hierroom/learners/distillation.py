r"""Random network distillation: a reward for observations on which a predictor does not yet match a random network.

The method is that of Burda, Edwards, Storkey & Klimov, Exploration by Random Network Distillation (2018). Our version
differs as follows:

- One value function estimates the return of extrinsic plus intrinsic rewards, which ends with the episode. Their
  section 2.3 allows this where both rewards are episodic and have the same discount; MiniGrid baselines do the same
  (Raileanu & Rocktaeschel, RIDE, 2020). Their two value heads serve an intrinsic return that continues across episodes.
- Their whitening (section 2.4: subtract the mean, divide by the standard deviation, clip to 5) applies to the one-hot
  vector of each categorical feature. So rare values, such as a key in view, stand out. The observations before the
  predictor's first update replace those of their random agent: they count for the whitening but give no reward.
- The running standard deviation of returns that divides intrinsic rewards (section 2.4) is updated at every step
  instead of once per rollout, because the learner needs the rewards at every step. There is also no reward while the
  first returns are still growing from zero.
- The predictor learns once per update from a random quarter of the observations, the share that they use with 128
  environments, with their learning rate of 1e-4. Layers have 64 units instead of 512, and there are no convolutions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from hierroom.learners.health import check_health
from hierroom.learners.networks.initial_weights import seeded_weights
from hierroom.support.errors import InputError
from hierroom.support.schema import RANDOM_STATE, Array, Exactly, Flag, Items, Table, Whole, like

EPOCHS, MINIBATCHES, SHARE, LEARNING_RATE, CLIP = 4, 4, 0.25, 1e-4, 5.0
_LEAST_DEVIATION = 1e-8
GROWTH = 2
"""Horizons 1 / (1 - gamma) until rewards begin: returns that start at 0 are then within 13% of the stationary ones."""


class RandomNetworkDistillation:
    r"""Intrinsic rewards of N environments: :math:`r_t = \| \hat f(s_{t+1}) - f(s_{t+1}) \|^2 / H / \sigma_t`.

    f is the fixed random network, f-hat its predictor, H the number of their outputs and sigma the running standard
    deviation of the returns :math:`R_t = \gamma R_{t-1} + \| \cdot \|^2 / H` of all environments. Rewards are zero
    until the predictor has learned once, for `GROWTH` horizons after that, and while all returns were equal.
    """

    def __init__(
        self,
        cardinalities: Sequence[int],  # number of values of each of the K features of an observation
        num_envs: int,
        *,
        gamma: float,  # discount of the returns, below 1
        seed: int,  # seed of the weights and minibatches
        hidden_size: int = 64,
        device: str = "cpu",
    ) -> None:
        if gamma >= 1:
            raise InputError(f"curiosity is scaled by discounted returns, so gamma must be below 1, not {gamma}")
        self._sizes = np.array(cardinalities)
        self._offsets = np.cumsum([0, *cardinalities[:-1]])  # [K] the one-hot index of each feature's value 0
        self._gamma = gamma
        self._device = device
        weight_seed, batch_seed = np.random.SeedSequence([seed, 2018]).spawn(2)
        self._random = np.random.default_rng(batch_seed)
        with seeded_weights(weight_seed):
            self.target = _Embedding(sum(cardinalities), hidden_size, n_layers=1).requires_grad_(False).to(device)
            self.predictor = _Embedding(sum(cardinalities), hidden_size, n_layers=3).to(device)
        self._adam = torch.optim.Adam(self.predictor.parameters(), lr=LEARNING_RATE)
        self._counts = np.ones(sum(cardinalities))  # [R] counts of each value, from 1 to avoid zeros
        self._has_learned = False
        self._returns = np.zeros(num_envs)
        self._growing = self._growing_at_first = round(GROWTH / (1 - gamma))  # steps before the returns are counted
        self._moments = np.zeros(3)  # count, mean and sum of squared differences of the returns
        self._pending: list[NDArray[np.uint8]] = []

    def rewards(self, features: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Return the intrinsic rewards [N] of a step, and keep the observations [N, K] after it for `learn`."""
        with torch.no_grad():
            errors = self._errors(features).cpu().numpy().astype(np.float64)
        self._pending.append(features.copy())
        if not self._has_learned:
            return np.zeros(len(errors))
        self._returns = self._gamma * self._returns + errors
        if self._growing:
            self._growing -= 1
            return np.zeros(len(errors))
        self._moments = _merged(self._moments, self._returns)
        number, _, squares = self._moments
        deviation = np.sqrt(squares / number)
        return errors / deviation if deviation > _LEAST_DEVIATION else np.zeros(len(errors))

    def learn(self) -> dict[str, float]:
        """Train the predictor on the observations since the last call; return its mean loss as ``curiosity_error``."""
        features = np.concatenate(self._pending)
        self._pending = []
        self._counts += np.bincount((features + self._offsets).ravel(), minlength=len(self._counts))
        losses = []
        for _ in range(EPOCHS):
            chosen = self._random.permutation(len(features))[: max(MINIBATCHES, int(SHARE * len(features)))]
            for part in np.array_split(chosen, min(MINIBATCHES, len(chosen))):
                loss = self._errors(features[part]).mean()
                self._adam.zero_grad()
                loss.backward()
                self._adam.step()
                losses.append(loss.item())
        self._has_learned = True
        advice = "curiosity has diverged: another --seed, or a method without it, may help"
        weights = ((f"predictor weights {name}", tensor) for name, tensor in self.predictor.state_dict().items())
        check_health([("curiosity_error", np.array(losses)), *weights], advice)
        return {"curiosity_error": float(np.mean(losses))}

    def _errors(self, features: NDArray[np.uint8]) -> Tensor:  # [M] mean squared prediction errors
        rows = torch.from_numpy(features + self._offsets).to(self._device)
        scale, shift = (torch.from_numpy(a).float().to(self._device) for a in whitening(self._counts, self._sizes))
        return (self.predictor(rows, scale, shift) - self.target(rows, scale, shift)).square().mean(-1)

    def state_dict(self) -> dict:
        """Return the complete state as tensors on the CPU and plain types."""
        adam = self._adam.state_dict()
        moments = {n: _copied(tensors) for n, tensors in adam["state"].items()}
        return {
            "target": _copied(self.target.state_dict()),
            "predictor": _copied(self.predictor.state_dict()),
            "adam": {"state": moments, "param_groups": deepcopy(adam["param_groups"])},
            **{name: torch.from_numpy(array.copy()) for name, array in self._arrays().items()},
            "has_learned": self._has_learned,
            "growing": self._growing,
            "pending": [torch.from_numpy(features) for features in self._pending],
            "random": self._random.bit_generator.state,
        }

    def load_state_dict(self, state: dict) -> None:
        """Restore the state that `state_dict` returned."""
        self._schema().check(state, "distillation")
        self.target.load_state_dict(state["target"])
        self.predictor.load_state_dict(state["predictor"])
        self._adam.load_state_dict(state["adam"])
        for name, array in self._arrays().items():
            array[...] = state[name].numpy()
        self._has_learned, self._growing = state["has_learned"], state["growing"]
        self._pending = [features.numpy().copy() for features in state["pending"]]
        self._random.bit_generator.state = state["random"]

    def _arrays(self) -> dict[str, NDArray[np.float64]]:
        return {"counts": self._counts, "returns": self._returns, "moments": self._moments}

    def _schema(self) -> Table:
        own, pending = self.state_dict(), (len(self._returns), len(self._sizes))
        moments = {
            i: Table({"step": Array(np.float32, (), 0), "exp_avg": like(p), "exp_avg_sq": like(p, 0)})
            for i, p in enumerate(self.predictor.parameters())
        }
        return Table(
            {
                **{
                    name: Table({key: like(value) for key, value in own[name].items()})
                    for name in ("target", "predictor")
                },
                "adam": Table({"state": Table(moments, moments), "param_groups": Exactly(own["adam"]["param_groups"])}),
                "counts": like(self._counts, 1),
                "has_learned": Flag(),
                "growing": Whole(0, self._growing_at_first),
                "returns": like(self._returns, 0),
                "moments": like(self._moments, 0),
                "pending": Items(Array(np.uint8, pending, 0, self._sizes - 1)),
                "random": RANDOM_STATE,
            }
        )


def _copied(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    # Adam's steps have torch's default type, which a user may have changed.
    return {name: tensor.detach().cpu().float().clone() for name, tensor in tensors.items()}


class _Embedding(nn.Module):
    """A layer on whitened one-hot features and ``n_layers`` more, each after a ReLU; H units, orthogonal weights."""

    def __init__(self, n_rows: int, hidden_size: int, n_layers: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(n_rows, hidden_size, dtype=torch.float32))
        self.bias = nn.Parameter(torch.zeros(hidden_size, dtype=torch.float32))
        nn.init.orthogonal_(self.weight, 2**0.5)
        layers = [nn.Linear(hidden_size, hidden_size, dtype=torch.float32) for _ in range(n_layers)]
        self.layers = nn.ModuleList(layers)
        for layer in layers:
            nn.init.orthogonal_(layer.weight, 2**0.5)
            nn.init.zeros_(layer.bias)

    def forward(self, rows: Tensor, scale: Tensor, shift: Tensor) -> Tensor:
        """Return outputs [M, H] for one-hot indices ``rows`` [M, K]; `whitening` gives scale and shift [R]."""
        table = self.weight * scale.unsqueeze(-1)
        features = functional.embedding_bag(rows, table, mode="sum") + shift @ self.weight + self.bias
        for layer in self.layers:
            features = layer(torch.relu(features))
        return features


def whitening(counts: NDArray[np.float64], sizes: NDArray[np.integer]) -> tuple[NDArray, NDArray]:
    r"""Return scale and shift [R] that whiten one-hot features: entry x of value i becomes ``scale[i] * x + shift[i]``.

    Let p be the frequency of the value within its feature and :math:`\sigma^2 = p (1 - p)`. A zero becomes :math:`-p /
    \sigma` and a one :math:`(1 - p) / \sigma`, both clipped to 5. A feature with only one value becomes 0. ``counts``
    [R] are the positive numbers of observations of each value, and ``sizes`` [K] the features' numbers of values.
    """
    share = counts / np.repeat(np.add.reduceat(counts, np.cumsum([0, *sizes[:-1]])), sizes)
    deviation = np.sqrt(share * (1 - share))
    deviation[deviation == 0] = np.inf
    zero, one = np.maximum(-share / deviation, -CLIP), np.minimum((1 - share) / deviation, CLIP)
    return one - zero, zero


def _merged(moments: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return count, mean and sum of squared differences after adding ``values`` (Chan, Golub & LeVeque 1983)."""
    number, mean, squares = moments
    total, difference = number + len(values), values.mean() - mean
    squares = squares + values.var() * len(values) + difference**2 * number * len(values) / total
    return np.array([total, mean + difference * len(values) / total, squares])
