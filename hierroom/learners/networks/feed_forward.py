"""Actor-critics of one `InputLayer`: without memory, and with the recurrent core."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic, make_heads
from hierroom.learners.networks.encoder import Vectors
from hierroom.learners.networks.input_layer import InputLayer, RectifiedInputLayer


class FeedForwardActorCritic(nn.Module):
    r"""A network without memory: a policy and a value trunk of two layers of H units each, and linear heads.

    .. math::
        h = \tanh(\tanh(E(x)) W + b)

    for each trunk, with the outputs E of its part of the `InputLayer`. The trunks share only the encoders of pictures,
    so the value loss cannot drown the policy. Sizes and initial weights are those of "The 37 Implementation Details of
    PPO" (Huang et al. 2022). Its state has no numbers.
    """

    def __init__(self, space: AgentSpace, hidden_size: int, vectors: Vectors = None, **inputs: Any) -> None:
        super().__init__()
        self.encoder = InputLayer(space, hidden_size, vectors, trunks=2, **inputs)
        self.core = Trunks(hidden_size)
        self.policy_head, self.value_head = make_heads(hidden_size, space)

    def initial_state(self, n: int) -> Tensor:
        """Return an empty state [n, 0]; see `PolicyNetwork.initial_state`."""
        return self.core.bias.new_zeros(n, 0)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Compute one turn; see `PolicyNetwork.step`."""
        return *self._heads(features), state

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """Compute T consecutive turns; see `PolicyNetwork.sequence`."""
        return self._heads(features)

    def _heads(self, features: Tensor) -> tuple[Tensor, Tensor]:
        policy, value = self.core(torch.tanh(self.encoder(features)))
        return self.policy_head(policy), self.value_head(value).squeeze(-1)


class Trunks(nn.Module):
    """The second layer of two trunks: a weight [2, H, H] and a bias [2, H]."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(2, size, size, dtype=torch.float32))
        self.bias = nn.Parameter(torch.zeros(2, size, dtype=torch.float32))
        with torch.no_grad():
            for weight in self.weight:
                nn.init.orthogonal_(weight, 2**0.5)

    def forward(self, first: Tensor) -> tuple[Tensor, Tensor]:
        """Return the outputs [..., H] of the policy's and of the value's trunk for their inputs [..., 2 H]."""
        policy, value = first.chunk(2, dim=-1)
        return torch.tanh(policy @ self.weight[0] + self.bias[0]), torch.tanh(value @ self.weight[1] + self.bias[1])


class ScaledActorCritic(RecurrentActorCritic):
    """`RecurrentActorCritic` with an `InputLayer` as its encoder."""

    def __init__(self, space: AgentSpace, hidden_size: int, vectors: Vectors = None, **inputs: Any) -> None:
        super().__init__(replace(space, cardinalities=(1,), arrays=()), hidden_size)
        self.encoder = RectifiedInputLayer(space, hidden_size, vectors, **inputs)
