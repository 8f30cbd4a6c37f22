r"""Policy sketches: a custom network of sub-policies, one for each goal.

python -m hierroom train --method ppo-sketch --network policy_sketches:PolicySketches \
    --features symbol view direction keys previous-action doorway-places frontier-places
"""

from collections.abc import Callable, Iterable
from typing import cast

import torch
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.recurrent import lstm_cell
from hierroom.support.errors import InputError

Part = Callable[..., tuple[Tensor, ...]]


class PolicySketches(nn.Module):
    """One sub-policy for each symbol, no parameter shared; the first feature of an observation is the symbol.

    After Andreas, Klein & Levine, Modular Multitask Reinforcement Learning with Policy Sketches (2017), section 3.1: a
    task is a sequence of symbols (its sketch). Each symbol has its own sub-policy, and they act in turn. What differs,
    and why:

    - Their sub-policies end by an action of their own, STOP; here the end of an option does.
    - Theirs have no memory. Ours are recurrent, and hand the state on to each other; so the gradient of one's loss
      reaches those that acted before it in the sequence.
    - Their symbols are of few kinds. Here a symbol is a goal, and so names the colour too: each sub-policy has a sixth
      of the turns that a key or door gets.
    - Their critics belong to tasks and are linear in the features. Here there is one task, and each sub-policy has a
      value head of its own.
    - Their curriculum over tasks is left to ``--curriculum-stages``.

    Args:
        space: what the agent observes and can do; the first feature is the symbol.
        hidden_size: units H of each sub-policy.

    Raises:
        InputError: if there is no feature besides the symbol.
    """

    def __init__(self, space: AgentSpace, hidden_size: int) -> None:
        super().__init__()
        n_symbols, *rest = space.cardinalities
        if not rest:
            raise InputError("sub-policies need a feature besides the symbol")
        seen = AgentSpace(tuple(rest), space.n_actions)
        self.parts = nn.ModuleList(RecurrentActorCritic(seen, hidden_size) for _ in range(n_symbols))

    def initial_state(self, n: int) -> Tensor:
        """Zeros [n, 2 H]: hidden and cell state side by side."""
        return cast(RecurrentActorCritic, self.parts[0]).initial_state(n)

    def step(self, features: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One turn; see `PolicyNetwork.step`."""
        logits, values, state = _each(self.parts, features[:, 0], RecurrentActorCritic.step, features[:, 1:], state)
        return logits, values, state

    def sequence(self, features: Tensor, state: Tensor, resets: Tensor) -> tuple[Tensor, Tensor]:
        """T turns in a row; see `PolicyNetwork.sequence`."""
        shape, flat = resets.shape, features.flatten(0, 1)
        # What does not wait for the step before is done for all turns of a symbol at once.
        (driven,) = _each(self.parts, flat[:, 0], _drive, flat[:, 1:])
        driven = driven.reshape(*shape, -1)  # [T, M, 4 H]
        keeps = (~resets).to(driven.dtype).unsqueeze(-1)  # [T, M, 1]
        hidden, cell = state.chunk(2, dim=-1)
        outputs = []
        # Cut up once: the gradient of driven[t], or of a part of a weight, is as large as all of it, for every t.
        parts = cast(Iterable[RecurrentActorCritic], self.parts)
        cores = [(part.core.bias, part.core.split_weight()[1]) for part in parts]
        for symbols, from_input, keep in zip(features[..., 0].unbind(), driven.unbind(), keeps.unbind(), strict=True):
            (recurrent,) = _each(cores, symbols, _recur, hidden * keep)
            hidden, cell = lstm_cell(recurrent + from_input, cell * keep)
            outputs.append(hidden)
        logits, values = _each(self.parts, flat[:, 0], _heads, torch.cat(outputs))
        return logits.reshape(*shape, -1), values.reshape(shape)


def _each(parts: Iterable, symbols: Tensor, function: Part, *inputs: Tensor) -> tuple[Tensor, ...]:
    """``function(part, *rows)`` for each symbol's part and rows of the inputs [N, ...]; outputs [N, ...]."""
    parts = list(parts)
    order = symbols.argsort(stable=True)
    counts = symbols.long().bincount(minlength=len(parts)).tolist()
    pieces = zip(*(tensor[order].split(counts) for tensor in inputs), strict=True)
    outputs = [function(part, *rows) for part, rows, n in zip(parts, pieces, counts, strict=True) if n]
    places = order.argsort()
    return tuple(torch.cat(column)[places] for column in zip(*outputs, strict=True))


def _drive(part: RecurrentActorCritic, features: Tensor) -> tuple[Tensor]:
    return (part.encoder(features) @ part.core.split_weight()[0],)


def _recur(core: tuple[Tensor, Tensor], hidden: Tensor) -> tuple[Tensor]:
    bias, of_hidden = core
    return (torch.addmm(bias, hidden, of_hidden),)


def _heads(part: RecurrentActorCritic, hidden: Tensor) -> tuple[Tensor, Tensor]:
    return part.policy_head(hidden), part.value_head(hidden).squeeze(-1)
