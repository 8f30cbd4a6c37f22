"""Rewards and networks of the variants of the sweeps called `differences` and of `study_factors`."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from hierroom.agents.features import Features
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.turns.records import Step
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.tiles import TRIPLES
from hierroom.worlds.make import world_spec

_VIEW = 49


class UncutIntrinsic:
    """1 where the given goal is reached, and the return goes on beyond it, over all goals of the episode."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.float64]:
        """Return 1 where the goal was reached [N]."""
        return step.reached.astype(np.float64)


class CutBonus:
    """1 for each key, door and the exit, and the return ends where the given goal is reached."""

    ends_with_option, needs_states = True, False

    def rewards(self, step: Step) -> NDArray[np.float64]:
        """Return how many goals were achieved for the first time [N]."""
        return step.n_first.astype(np.float64)


class RepeatedBonus:
    """1 for each key, door and the exit as often as it is achieved: a key that was dropped can be picked up again."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.float64]:
        """Return 1 where a goal was achieved [N]."""
        return (step.events >= 0).astype(np.float64)


def usual_weights(space: AgentSpace, hidden_size: int) -> RecurrentActorCritic:
    """Return the network of preset `paper`, with weights and biases in the range of torch's own linear layers and LSTM.

    Torch's LSTM adds two biases of that range, this network has one.

    Args:
        space: of the features view-ids and goal.
        hidden_size: units.
    """
    network = RecurrentActorCritic(space, hidden_size, Features(world_spec(EnvConfig()), ("view-ids", "goal")).vectors)
    n_inputs = len(network.encoder.weight)
    for module in (network.encoder, network.core, network.policy_head, network.value_head):
        bound = (n_inputs if module is network.encoder else hidden_size) ** -0.5
        for parameter in module.parameters():
            nn.init.uniform_(parameter, -bound, bound)
    return network


class PlainLSTM(nn.Module):
    """The numbers of the view, divided by 10, and the one-hot goal go straight into torch's LSTM, with its own weights.

    Args:
        space: of the features view-ids and goal.
        hidden_size: units.
    """

    def __init__(self, space: AgentSpace, hidden_size: int) -> None:
        super().__init__()
        self._cardinalities = space.cardinalities[_VIEW:]
        self.register_buffer("_triples", torch.tensor(TRIPLES, dtype=torch.float32) / 10, persistent=False)
        self.core = nn.LSTM(_VIEW * TRIPLES.shape[1] + sum(self._cardinalities), hidden_size)
        self.policy_head, self.value_head = nn.Linear(hidden_size, space.n_actions), nn.Linear(hidden_size, 1)

    def initial_state(self, n: int) -> Tensor:
        """Zeros [n, 2 H]."""
        return self.policy_head.weight.new_zeros(n, 2 * self.core.hidden_size)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One turn; see `PolicyNetwork.step`."""
        hidden, cell = (part.contiguous().unsqueeze(0) for part in state.chunk(2, dim=-1))
        output, (hidden, cell) = self.core(self._inputs(features).unsqueeze(0), (hidden, cell))
        return *self._heads(output[0]), torch.cat([hidden[0], cell[0]], dim=-1)

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """Several turns; see `PolicyNetwork.sequence`. Runs of turns without a reset are computed together."""
        inputs, outputs = self._inputs(features), []
        starts = [0, *(t for t in range(1, len(inputs)) if bool(resets[t].any())), len(inputs)]
        for start, end in pairwise(starts):
            state = state * (~resets[start]).to(state.dtype).unsqueeze(-1)
            hidden, cell = (part.contiguous().unsqueeze(0) for part in state.chunk(2, dim=-1))
            output, (hidden, cell) = self.core(inputs[start:end], (hidden, cell))
            outputs.append(output)
            state = torch.cat([hidden[0], cell[0]], dim=-1)
        return self._heads(torch.cat(outputs))

    def _inputs(self, features: Tensor) -> Tensor:
        view, others = features[..., :_VIEW].long(), features[..., _VIEW:].long()
        parts = [self._triples[view].flatten(-2)]
        parts += [functional.one_hot(others[..., n], size).float() for n, size in enumerate(self._cardinalities)]
        return torch.cat(parts, dim=-1)

    def _heads(self, hidden: Tensor) -> tuple[Tensor, Tensor]:
        return self.policy_head(hidden), self.value_head(hidden).squeeze(-1)
