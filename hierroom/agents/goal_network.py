"""The learned meta-controller's network for EscapeRooms: one core that all colours share."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.networks.recurrent import ResetLSTM


class GoalNetwork(nn.Module):
    r"""An actor-critic over goals that treats all colours alike.

    Each episode draws new colours, so what is learned about one is true of all. Each of the P parts of a level, such as
    six colours and the exit, has its own recurrent state and shares its weights. It sees itself and the mean of all
    parts (deep sets: Zaheer et al. 2017). With encoder E (one for colours, one for the exit) and features x:

    .. math::
        e_p = E(x_p), \qquad h_p = \mathrm{LSTM}\big(e_p, \tfrac1P \sum_q e_q\big), \qquad
        \bar h = \tfrac1P \sum_q h_q

    Logits of a colour's key and door are linear in :math:`(h_p, \bar h)`, those of the exit and of 'no goal' in
    the exit's state, the value in :math:`\bar h`. Permuting colours permutes keys' and doors' logits in the same way.

    It implements `PolicyNetwork`; a state [N, P * 2 H] has the parts' states one after the other.

    Args:
        space: features with one number for each of G goals, one feature after the other, and G + 1 actions.
        hidden_size: units H of encoders and core.
        n_alike: number of colours. The goals of one kind follow each other, one for each colour; the exit is last.
    """

    def __init__(self, space: AgentSpace, hidden_size: int, n_alike: int) -> None:
        super().__init__()
        cardinalities, n_goals = space.cardinalities, space.n_actions - 1
        by_feature = [cardinalities[i : i + n_goals] for i in range(0, space.n_features, n_goals)]
        self._n_features, self._n_goals, self._n_alike = len(by_feature), n_goals, n_alike
        self._n_parts, n_kinds = n_alike + 1, (n_goals - 1) // n_alike
        self._hidden_size = hidden_size
        of_colour = [row[: n_kinds * n_alike : n_alike] for row in by_feature]
        self.colour_encoder = FeatureEncoder([c for pair in zip(*of_colour, strict=True) for c in pair], hidden_size)
        self.exit_encoder = FeatureEncoder([row[-1] for row in by_feature], hidden_size)
        self.core = ResetLSTM(2 * hidden_size, hidden_size)
        self.colour_head = nn.Linear(2 * hidden_size, n_kinds, dtype=torch.float32)
        self.exit_head = nn.Linear(hidden_size, 2, dtype=torch.float32)
        self.value_head = nn.Linear(hidden_size, 1, dtype=torch.float32)
        for head, gain in ((self.colour_head, 0.01), (self.exit_head, 0.01), (self.value_head, 1.0)):
            nn.init.orthogonal_(head.weight, gain)  # as in `RecurrentActorCritic`
            nn.init.zeros_(head.bias)

    def initial_state(self, n: int) -> Tensor:
        """Return zeros [n, P * 2 H]."""
        return self.core.weight.new_zeros(n, self._n_parts * 2 * self._hidden_size)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Compute one turn; see `PolicyNetwork.step`. Each part is a separate row for the core."""
        n = len(features)
        hidden, state = self.core.step(self._encode(features).flatten(0, 1), state.reshape(n * self._n_parts, -1))
        return *self._heads(hidden.reshape(n, self._n_parts, -1)), state.reshape(n, -1)

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """Compute T turns in a row; see `PolicyNetwork.sequence`."""
        length, n = resets.shape
        n_parts = self._n_parts
        states, resets = state.reshape(n * n_parts, -1), resets.repeat_interleave(n_parts, dim=1)
        hidden = self.core.sequence(self._encode(features).flatten(1, 2), states, resets)
        return self._heads(hidden.reshape(length, n, n_parts, -1))

    def _encode(self, features: Tensor) -> Tensor:
        """Encode features [..., K] as [..., P, 2 H]: each part and the mean of all."""
        by_feature = features.unflatten(-1, (self._n_features, self._n_goals))  # [..., I, G]
        *kinds, exits = by_feature.split((*(self._n_alike,) * self.colour_head.out_features, 1), dim=-1)
        colours = self.colour_encoder(torch.cat(kinds, dim=-2).transpose(-1, -2))  # [..., P - 1, H]
        parts = torch.cat([colours, self.exit_encoder(exits.transpose(-1, -2))], dim=-2)  # [..., P, H]
        return torch.cat([parts, parts.mean(-2, keepdim=True).expand_as(parts)], dim=-1)

    def _heads(self, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Map [..., P, H] to logits [..., G + 1] of the kinds, the exit and no goal, and to values [...]."""
        mean, colours = hidden.mean(-2), hidden[..., :-1, :]
        means = mean.unsqueeze(-2).expand_as(colours)
        kinds = self.colour_head(torch.cat([colours, means], dim=-1)).unbind(-1)  # [..., P - 1] each
        return torch.cat([*kinds, self.exit_head(hidden[..., -1, :])], dim=-1), self.value_head(mean).squeeze(-1)
