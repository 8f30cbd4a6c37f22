"""The controller's network: the built-in ones, loading custom ones, and a trial before training."""

from __future__ import annotations

from copy import deepcopy
from threading import Lock
from typing import cast

import torch
from torch import Tensor, nn

from hierroom.agents.config import DEFAULT_NETWORK
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace, PolicyNetwork, RecurrentActorCritic
from hierroom.learners.networks.array_network import ArrayActorCritic
from hierroom.learners.networks.encoder import Vectors
from hierroom.learners.networks.feed_forward import FeedForwardActorCritic, ScaledActorCritic
from hierroom.support.errors import InputError, shown, user_code
from hierroom.support.plugins import load_plugin

_N_TURNS = 3
_TOLERANCE = 1e-3
"""Tolerance between outputs of `PolicyNetwork.step` and of `PolicyNetwork.sequence`, absolute and relative."""
_one_tries = Lock()


def make_network(
    spec: str, space: AgentSpace, hidden_size: int, vectors: Vectors, config: PPOConfig | None = None
) -> nn.Module:
    """Return the network that a user specified, after a trial of a custom one.

    Args:
        spec: `DEFAULT_NETWORK`, or ``package.module:Class``, a `torch.nn.Module` that implements `PolicyNetwork`.
        vectors: fixed vectors for values of features, for built-in networks (see `FeatureEncoder`). Custom networks get
            only the space and the hidden size.
        config: says which built-in network; None: `PPOConfig`'s defaults.
    """
    config = config or PPOConfig()
    if not isinstance(spec, str):
        raise InputError(f"a network is named, like {DEFAULT_NETWORK} or package.module:Class, not {shown(spec)}")
    if spec == DEFAULT_NETWORK:  # compiled kernels can train it if the space has no arrays
        inputs = {"pictures": config.pictures, "scaled": config.scale_observations}
        if config.memory == "none":
            return FeedForwardActorCritic(space, hidden_size, vectors, **inputs)
        if not space.arrays:
            return RecurrentActorCritic(space, hidden_size, vectors)
        if config.scale_observations or config.pictures != "small":
            return ScaledActorCritic(space, hidden_size, vectors, **inputs)
        return ArrayActorCritic(space, hidden_size, vectors)
    make = load_plugin(spec, "network", (DEFAULT_NETWORK,))
    with user_code(f"the network {spec!r}", "cannot be made"):
        network = make(space, hidden_size)
    if not isinstance(network, nn.Module) or not isinstance(network, PolicyNetwork):
        raise InputError(f"the network {spec!r} must be a torch.nn.Module with initial_state, step and sequence")
    try_network(f"the network {spec!r}", network, space)
    return network


def try_network(name: str, network: nn.Module, space: AgentSpace) -> None:
    """Take three turns with a copy in two environments and in one; refuse a network that the learner could not train.

    Only one network is tried at a time, because layers such as dropout draw from torch's global generator. Its state is
    restored afterwards.
    """
    if not any(parameter.requires_grad for parameter in network.parameters()):
        raise InputError(f"{name} has no weights to learn: no parameter requires a gradient")
    with user_code(f"{name}, in its first turns,"), _one_tries, torch.random.fork_rng([]):
        if other := [entry for entry, value in network.state_dict().items() if not isinstance(value, Tensor)]:
            raise InputError(f"{name} has a state_dict whose {other[0]} is no tensor; runs save only tensors")
        tried = deepcopy(network)
        for n_envs in (2, 1):
            _take_turns(name, cast(PolicyNetwork, tried), space, n_envs)
        tried.eval()  # turns off random layers such as dropout
        _compare(name, cast(PolicyNetwork, tried), space)


def _turns(space: AgentSpace, n_envs: int) -> Tensor:
    last = torch.tensor(space.cardinalities) - 1
    turns = torch.stack([last * t // (_N_TURNS - 1) for t in range(_N_TURNS)]).byte()
    for start, array in space.arrays:
        turns[:, start : start + array.n_bytes] = torch.from_numpy(array.examples(_N_TURNS))
    return turns.unsqueeze(1).repeat(1, n_envs, 1)


def _take_turns(name: str, network: PolicyNetwork, space: AgentSpace, n_envs: int) -> None:
    features = _turns(space, n_envs)
    with torch.no_grad():
        state = network.initial_state(n_envs)
        start = tuple(state.shape)
        if len(start) != 2 or start[0] != n_envs:
            raise InputError(f"{name} gives {n_envs} environments an initial state of shape {start}, not rows")
        logits, values, after = network.step(features[0].clone(), state.clone())  # it may write to its inputs
    all_logits, all_values = network.sequence(features, state, torch.zeros(_N_TURNS, n_envs, dtype=torch.bool))
    trained = {"logits of sequence": all_logits, "values of sequence": all_values}
    outputs = {"an initial state": state, "logits of step": logits, "values of step": values, "state of step": after}
    shapes = (start, (n_envs, space.n_actions), (n_envs,), start)
    shapes += ((_N_TURNS, n_envs, space.n_actions), (_N_TURNS, n_envs))
    for (what, output), shape in zip((outputs | trained).items(), shapes, strict=True):
        if tuple(output.shape) != shape:
            raise InputError(f"{name} gives {what} of shape {tuple(output.shape)}, not {shape}")
        if output.dtype is not torch.float32:
            raise InputError(f"{name} gives {what} of {output.dtype}, not torch.float32")
        if not output.isfinite().all():
            raise InputError(f"{name} gives {what} that are not finite: {output[~output.isfinite()][0]:g}")
    for what, output in trained.items():
        if not output.requires_grad:
            raise InputError(f"{name} gives {what} without a gradient: no weight can learn from them")
    (all_logits.sum() + all_values.sum()).backward()


def _compare(name: str, network: PolicyNetwork, space: AgentSpace) -> None:
    features = _turns(space, 2)
    resets = torch.zeros(_N_TURNS, 2, dtype=torch.bool)
    resets[-1, 0] = True  # an episode begins in one environment only
    with torch.no_grad():
        start = state = network.initial_state(2)
        played = []
        for turn, reset in zip(features, resets, strict=True):
            begun = torch.where(reset.unsqueeze(1), network.initial_state(2), state)
            *outputs, state = network.step(turn.clone(), begun)
            played.append(outputs)
        trained = network.sequence(features, start, resets)
    for what, turns, whole in zip(("logits", "values"), zip(*played, strict=True), trained, strict=True):
        difference = (torch.stack([*turns]) - whole).abs()
        if not (difference <= _TOLERANCE * (1 + whole.abs())).all():
            raise InputError(
                f"{name} gives other {what} in sequence than in step, by up to {difference.max():.3g}; "
                "both compute the same turns, and where resets are True, a turn begins with initial_state"
            )
