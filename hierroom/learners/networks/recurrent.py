"""The recurrent core: an LSTM that resets its state inside a sequence wherever an episode begins."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class ResetLSTM(nn.Module):
    r"""A long short-term memory (Hochreiter & Schmidhuber 1997, with the forget gate of Gers et al. 2000).

    The gates are in the order input, forget, candidate, output:

    .. math::
        (i, f, g, o) &= (x_t, h_{t-1}) W + b \\
        c_t &= \sigma(f)\, c_{t-1} + \sigma(i) \tanh(g), \qquad h_t = \sigma(o) \tanh(c_t)

    ``weight`` is [X + H, 4 H], the X rows of the input above the H rows of the hidden state, so that a step is one
    matrix product. Both blocks are initialised orthogonally and the bias is zero.
    """

    def __init__(self, input_size: int, hidden_size: int) -> None:
        super().__init__()
        self.input_size = input_size
        self.hidden_size = hidden_size
        self.weight = nn.Parameter(torch.empty(input_size + hidden_size, 4 * hidden_size, dtype=torch.float32))
        self.bias = nn.Parameter(torch.zeros(4 * hidden_size, dtype=torch.float32))
        with torch.no_grad():
            nn.init.orthogonal_(self.weight[:input_size])
            nn.init.orthogonal_(self.weight[input_size:])

    def initial_state(self, n: int) -> Tensor:
        """Return zeros [n, 2 H]: the hidden state, then the cell state."""
        return self.weight.new_zeros(n, 2 * self.hidden_size)

    def step(self, inputs: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Compute the output [N, H] (the hidden state) and the new state [N, 2 H] from inputs [N, X] and state."""
        hidden, cell = state.chunk(2, dim=-1)
        of_inputs, of_hidden = self.split_weight()
        hidden, cell = lstm_cell(torch.addmm(self.bias, hidden, of_hidden) + inputs @ of_inputs, cell)
        return hidden, torch.cat([hidden, cell], dim=-1)

    def sequence(self, inputs: Tensor, state: Tensor, resets: Tensor) -> Tensor:
        """Compute outputs [T, M, H] from inputs [T, M, X] and a state [M, 2 H]; ``resets`` [T, M] set it to zero."""
        of_inputs, of_hidden = self.split_weight()
        driven = inputs @ of_inputs  # [T, M, 4 H]: terms that do not depend on the previous step
        keeps = (~resets).to(driven.dtype).unsqueeze(-1)  # [T, M, 1]
        hidden, cell = state.chunk(2, dim=-1)
        outputs = []
        # Unbind once: indexing driven[t] would create a gradient as large as all of driven for every t.
        for from_input, keep in zip(driven.unbind(), keeps.unbind(), strict=True):
            gates = torch.addmm(self.bias, hidden * keep, of_hidden) + from_input
            hidden, cell = lstm_cell(gates, cell * keep)
            outputs.append(hidden)
        return torch.stack(outputs)

    def split_weight(self) -> tuple[Tensor, Tensor]:
        """Return the rows of ``weight`` for the input [X, 4 H] and for the hidden state [H, 4 H]."""
        of_inputs, of_hidden = self.weight.split((self.input_size, self.hidden_size))
        return of_inputs, of_hidden


def lstm_cell(gates: Tensor, cell: Tensor) -> tuple[Tensor, Tensor]:
    """Return new hidden and cell states from gates [N, 4 H] and cell states [N, H]; see `ResetLSTM`."""
    input_gate, forget_gate, candidate, output_gate = gates.chunk(4, dim=-1)
    cell = torch.sigmoid(forget_gate) * cell + torch.sigmoid(input_gate) * torch.tanh(candidate)
    return torch.sigmoid(output_gate) * torch.tanh(cell), cell
