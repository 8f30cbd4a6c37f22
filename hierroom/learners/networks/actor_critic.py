"""The observation and action space of an agent, the protocol of its network, and the default recurrent actor-critic."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, cast, runtime_checkable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hierroom.learners.networks.encoder import FeatureEncoder, Vectors
from hierroom.learners.networks.recurrent import ResetLSTM
from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class AgentSpace:
    """The observations and actions of an agent.

    Args:
        cardinalities: number of values of each of the K features of an observation, 1 to 256 each.
        n_actions: A, the number of the policy's outputs, at least 1: for discrete actions the number of all actions.
        arrays: each array of bytes, after its first column.
        kind: discrete actions; multi, which are several discrete numbers; or box, which are several real numbers.
        sizes: the number of outputs for each number of an action. A box has two, and first all means, in units in which
            its bounds are -1 and 1, then all logarithms of deviations. Empty: discrete.
    """

    cardinalities: tuple[int, ...]
    n_actions: int
    arrays: tuple[tuple[int, ByteArray], ...] = ()
    kind: Literal["discrete", "multi", "box"] = "discrete"
    sizes: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "cardinalities", tuple(int(c) for c in self.cardinalities))
        if not self.cardinalities or not all(1 <= c <= 256 for c in self.cardinalities):
            raise InputError(f"an observation needs features of 1 to 256 values each, not {self.cardinalities}")
        if self.n_actions < 1:
            raise InputError(f"an agent needs at least 1 action, not {self.n_actions}")

    @property
    def n_masked(self) -> int:
        """Number of actions of which masks say whether they are legal; other kinds than discrete have no masks."""
        return self.n_actions if self.kind == "discrete" else 0

    def __deepcopy__(self, memo: object) -> AgentSpace:
        """Return itself, as it never changes; so a copied policy is still known as its learner's."""
        return self

    @property
    def n_features(self) -> int:
        """Number of features K of an observation."""
        return len(self.cardinalities)

    def check_features(self, envs: NDArray[np.integer], features: NDArray[np.uint8]) -> None:
        """Check observations [M, K] of ``envs`` [M], because compiled code does not check array bounds."""
        _check_rows("features", features, len(envs), self.n_features)
        if (features > self._last_values).any():
            m, feature = np.argwhere(features > self._last_values)[0]
            found = f"it is {features[m, feature]} in environment {envs[m]}"
            raise InputError(f"feature {feature} must be below {self.cardinalities[feature]}, but {found}")

    def check_masks(self, envs: NDArray[np.integer], masks: NDArray[np.bool_]) -> None:
        """Check masks [M, A] of ``envs`` [M]."""
        _check_rows("masks", masks, len(envs), self.n_masked)
        is_legal = masks.any(axis=1)
        if self.n_masked and not is_legal.all():
            raise InputError(f"environment {envs[np.argmin(is_legal)]} has no legal action: its mask is all False")

    @cached_property
    def _last_values(self) -> NDArray[np.uint8]:
        return (np.array(self.cardinalities) - 1).astype(np.uint8)  # [K]


def _check_rows(name: str, array: NDArray, *shape: int) -> None:
    if array.shape != shape:
        raise InputError(f"{name} must have shape {shape}, a row per environment, not {array.shape}")


@runtime_checkable
class PolicyNetwork(Protocol):
    """The methods that a `torch.nn.Module` needs so that the `Learner` can train it; it needs no base class.

    ``Network(space, hidden_size)`` builds the network. It gets no masks: the learner removes illegal actions from the
    logits afterwards. Initial weights depend on the run's seed. Later random numbers, such as those of dropout, come
    from torch's global generator, which all threads share. Seed it yourself, and train one such network at a time.
    """

    def initial_state(self, n: int) -> Tensor:
        """Return the states [n, S] float of ``n`` environments at the start of an episode."""
        ...

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Compute logits [N, A], values [N] and new states [N, S] from observations [N, K] and states [N, S]."""
        ...

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """Compute logits [T, M, A] and values [T, M] of T turns from observations [T, M, K] and first states [M, S].

        The result is that of T calls of `step`, with `initial_state` before each turn where ``resets`` [T, M] is True.
        """
        ...


class OneTurn(nn.Module):
    """A `PolicyNetwork` as a plain module for `torch.export`; each call computes one turn.

    A call takes the features [N, K] uint8 of an observation and the state [N, S] float32 before the turn. It returns
    the logits [N, A] float32 of all actions, legal or not, the values [N] float32 and the state [N, S] after the turn.
    `AgentSpace` says what the logits are for actions that are arrays.

    Examples:
        >>> import torch
        >>> agent = hierroom.load("a")
        >>> features = torch.zeros(2, len(agent.controller.features.cardinalities), dtype=torch.uint8)
        >>> logits, values, state = agent.network(features, agent.network.initial_state(2))
        >>> logits.shape, values.shape
        (torch.Size([2, 5]), torch.Size([2]))
    """

    def __init__(self, network: nn.Module) -> None:
        super().__init__()
        self.network = network

    def initial_state(self, n: int) -> Tensor:
        """Return the states [n, S] of ``n`` environments at the start of an episode."""
        return cast(PolicyNetwork, self.network).initial_state(n)

    def forward(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return logits [N, A], values [N] and new states [N, S]."""
        logits, values, state = cast(PolicyNetwork, self.network).step(features, state)
        scale = getattr(self.network, "return_scale", None)
        return logits, values if scale is None else values / scale.factor, state


def make_heads(hidden_size: int, space: AgentSpace) -> tuple[nn.Module, nn.Linear]:
    """Return a policy head with a nearly uniform first policy, and a value head, both of H inputs."""
    n_outputs = len(space.sizes) if space.kind == "box" else space.n_actions
    policy = nn.Linear(hidden_size, n_outputs, dtype=torch.float32)
    value = nn.Linear(hidden_size, 1, dtype=torch.float32)
    for head, gain in ((policy, 0.01), (value, 1.0)):
        nn.init.orthogonal_(head.weight, gain)
        nn.init.zeros_(head.bias)
    return GaussianHead(policy) if space.kind == "box" else policy, value


class GaussianHead(nn.Module):
    """A layer for the K means, and K weights for the logarithms of deviations, which do not depend on the state.

    As in "The 37 Implementation Details of PPO" (continuous actions, 2 and 3), they start at 0.
    """

    def __init__(self, means: nn.Linear) -> None:
        super().__init__()
        self.means = means
        self.log_deviations = nn.Parameter(torch.zeros(means.out_features, dtype=torch.float32))

    def forward(self, hidden: Tensor) -> Tensor:
        """Return the means and the logarithms of deviations [..., 2 K] for inputs [..., H]."""
        means = self.means(hidden)
        return torch.cat([means, self.log_deviations.expand_as(means)], dim=-1)


class RecurrentActorCritic(nn.Module):
    """An encoder and an LSTM core of H hidden units each, and linear policy and value heads that read the core.

    Weights are initialised as in "The 37 Implementation Details of PPO" (Huang et al. 2022): orthogonal, with gain
    sqrt 2 in the encoder, 0.01 in the policy head (so that the first policy is nearly uniform) and 1 in the value head.
    Biases are zero. `FeatureEncoder` explains ``feature_vectors``.
    """

    def __init__(self, space: AgentSpace, hidden_size: int, feature_vectors: Vectors = None) -> None:
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size, feature_vectors)
        self.core = ResetLSTM(hidden_size, hidden_size)
        self.policy_head, self.value_head = make_heads(hidden_size, space)

    def initial_state(self, n: int) -> Tensor:
        """Return zeros [n, 2 H]; see `PolicyNetwork.initial_state`."""
        return self.core.initial_state(n)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Compute one turn; see `PolicyNetwork.step`."""
        hidden, state = self.core.step(self.encoder(features), state)
        return self.policy_head(hidden), self.value_head(hidden).squeeze(-1), state

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """Compute T consecutive turns; see `PolicyNetwork.sequence`."""
        hidden = self.core.sequence(self.encoder(features), state, resets)  # [T, M, H]
        return self.policy_head(hidden), self.value_head(hidden).squeeze(-1)
