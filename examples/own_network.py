"""A custom controller network: python -m hierroom train --network own_network:GatedMemory."""

import torch
from torch import nn

from hierroom.learners.networks.encoder import FeatureEncoder


class GatedMemory(nn.Module):
    """A gated recurrent unit between a table of learned rows and one linear layer for policy and value."""

    def __init__(self, space, hidden_size):
        """Take a space with ``cardinalities`` (the number of values of each entry) and ``n_actions``."""
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size)
        self.core = nn.GRUCell(hidden_size, hidden_size)
        self.heads = nn.Linear(hidden_size, space.n_actions + 1)

    def initial_state(self, n):
        """Return the state [n, S] of n environments at the start of an episode."""
        return self.heads.weight.new_zeros(n, self.core.hidden_size)

    def step(self, features, state):
        """One turn: features [N, K] and states [N, S] to logits [N, A], values [N] and the states after [N, S]."""
        state = self.core(self.encoder(features), state)
        outputs = self.heads(state)
        return outputs[:, :-1], outputs[:, -1], state

    def sequence(self, features, state, resets):
        """T turns: features [T, M, K], first states [M, S], resets [T, M] to logits [T, M, A] and values [T, M]."""
        outputs = []
        for t in range(len(features)):
            *turn, state = self.step(features[t], state * ~resets[t, :, None])
            outputs.append(turn)
        logits, values = (torch.stack(column) for column in zip(*outputs, strict=True))
        return logits, values
