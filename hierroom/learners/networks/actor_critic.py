"""The networks an agent can have: the protocol any network keeps, and the recurrent actor-critic that ships."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from torch import Tensor, nn

from hierroom.errors import InputError
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.networks.recurrent import ResetLSTM


@dataclass(frozen=True)
class AgentSpace:
    """What an agent sees and can do.

    Args:
        cardinalities: number of values of each of the K columns of an observation, 1 to 256 each.
        n_actions: actions A of the agent, legal or not.

    Raises:
        InputError: if there is no column, a column has no value or more than 256, or there is no action.
    """

    cardinalities: tuple[int, ...]
    n_actions: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "cardinalities", tuple(int(c) for c in self.cardinalities))
        if not self.cardinalities or not all(1 <= c <= 256 for c in self.cardinalities):
            raise InputError(f"an observation has columns of 1 to 256 values each, not {self.cardinalities}")
        if self.n_actions < 1:
            raise InputError(f"an agent has at least 1 action, not {self.n_actions}")

    @property
    def n_features(self) -> int:
        """Columns K of an observation."""
        return len(self.cardinalities)

    def check_features(self, envs: NDArray[np.integer], features: NDArray[np.uint8]) -> None:
        """Refuse observations [M, K] of ``envs`` [M] that are not of this space: compiled code would not notice.

        Raises:
            InputError: if the shape is another, or a value is outside its column's range.
        """
        if features.shape != (len(envs), self.n_features):
            raise InputError(
                f"features of {len(envs)} environments are [{len(envs)}, {self.n_features}], not {features.shape}"
            )
        if (features > self._last_values).any():
            m, column = np.argwhere(features > self._last_values)[0]
            raise InputError(
                f"column {column} has values below {self.cardinalities[column]}, "
                f"but environment {envs[m]} shows {features[m, column]}"
            )

    def check_masks(self, envs: NDArray[np.integer], masks: NDArray[np.bool_]) -> None:
        """Refuse masks [M, A] of ``envs`` [M] that leave an environment no legal action.

        Raises:
            InputError: naming the first such environment, or if the shape is another.
        """
        if masks.shape != (len(envs), self.n_actions):
            raise InputError(
                f"masks of {len(envs)} environments are [{len(envs)}, {self.n_actions}], not {masks.shape}"
            )
        is_legal = masks.any(axis=1)
        if not is_legal.all():
            raise InputError(f"environment {envs[np.argmin(is_legal)]} has no legal action: its mask is all False")

    @cached_property
    def _last_values(self) -> NDArray[np.uint8]:
        return (np.array(self.cardinalities) - 1).astype(np.uint8)  # [K]


@runtime_checkable
class PolicyNetwork(Protocol):
    """What a `torch.nn.Module` must offer to be trained by the `Learner`: three methods, no base class of ours.

    It is built as ``Network(space, hidden_size)``. Masks are none of its business: illegal actions are taken out of
    its logits afterwards, so that no network can forget to.
    """

    def initial_state(self, n: int) -> Tensor:
        """The state of ``n`` environments at the start of an episode: [n, S] float, one flat row per environment."""
        ...

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One turn.

        Args:
            features: [N, K] uint8 observations.
            state: [N, S] float, the states before the turn.

        Returns:
            logits [N, A], values [N] and the states after the turn [N, S].
        """
        ...

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """T turns in a row, equal to T calls of `step` with resets in between.

        Args:
            features: [T, M, K] uint8 observations.
            state: [M, S] float, the states before turn 0.
            resets: [T, M] bool, whether a turn begins an episode: its state is then `initial_state`, whatever it was.

        Returns:
            logits [T, M, A] and values [T, M].
        """
        ...


class RecurrentActorCritic(nn.Module):
    """Encoder, LSTM core, and a linear head each for policy and value; both read the same core.

    Initialised as in "The 37 Implementation Details of PPO" (Huang et al. 2022): orthogonal weights, gain sqrt 2 in
    the encoder, 0.01 in the policy head (the first policy is close to uniform), 1 in the value head; biases zero.

    Args:
        space: what the agent sees and can do.
        hidden_size: units H of encoder and core.
        feature_vectors: how values are fed, see `FeatureEncoder`; None: a learned row for each value of each column.
    """

    def __init__(
        self,
        space: AgentSpace,
        hidden_size: int,
        feature_vectors: Sequence[ArrayLike | None] | None = None,
    ) -> None:
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size, feature_vectors)
        self.core = ResetLSTM(hidden_size, hidden_size)
        self.policy_head = nn.Linear(hidden_size, space.n_actions)
        self.value_head = nn.Linear(hidden_size, 1)
        nn.init.orthogonal_(self.policy_head.weight, 0.01)
        nn.init.orthogonal_(self.value_head.weight, 1.0)
        nn.init.zeros_(self.policy_head.bias)
        nn.init.zeros_(self.value_head.bias)

    def initial_state(self, n: int) -> Tensor:
        """Zeros [n, 2 H]: hidden and cell state side by side."""
        return self.core.initial_state(n)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One turn; see `PolicyNetwork.step`."""
        hidden, state = self.core.step(self.encoder(features), state)
        return self.policy_head(hidden), self.value_head(hidden).squeeze(-1), state

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """T turns in a row; see `PolicyNetwork.sequence`."""
        hidden = self.core.sequence(self.encoder(features), state, resets)  # [T, M, H]
        return self.policy_head(hidden), self.value_head(hidden).squeeze(-1)
