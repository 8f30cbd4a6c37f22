"""The controller's network: those that ship, and how a user's own is found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from numpy.typing import NDArray
from torch import nn

from hierroom.agents.network_trial import try_network
from hierroom.learners.networks.actor_critic import AgentSpace, PolicyNetwork, RecurrentActorCritic
from hierroom.support.errors import InputError, in_one_line, shown
from hierroom.support.plugins import load_plugin

ENTRY_POINT_GROUP = "hierroom.networks"
Vectors = Sequence[NDArray | None] | None


NETWORKS: Mapping[str, Callable[[AgentSpace, int, Vectors], nn.Module]] = {"recurrent": RecurrentActorCritic}
"""The networks that ship, by the name users type: each is made from a space, a hidden size and vectors."""


def make_network(spec: str, space: AgentSpace, hidden_size: int, vectors: Vectors) -> nn.Module:
    """The network a user means, tried once.

    Args:
        spec: a name in `NETWORKS`; the name of an entry point in the group ``hierroom.networks``; or
            ``package.module:Class``, a `torch.nn.Module` that keeps the `PolicyNetwork` protocol.
        space: what the agent observes and can do.
        hidden_size: units.
        vectors: fixed numbers for the values of features, for a network that ships (see `FeatureEncoder`); a user's own
            network is made from the space and the hidden size alone.
    """
    if not isinstance(spec, str):
        raise InputError(f"a network is named, like {', '.join(NETWORKS)} or package.module:Class, not {shown(spec)}")
    if spec in NETWORKS:
        return NETWORKS[spec](space, hidden_size, vectors)
    make = load_plugin(spec, "network", NETWORKS, ENTRY_POINT_GROUP)
    try:
        network = make(space, hidden_size)
    except (Exception, SystemExit) as error:  # whatever a user's own code may raise
        raise InputError(f"the network {spec!r} cannot be made: {in_one_line(error)}") from error
    if not isinstance(network, nn.Module) or not isinstance(network, PolicyNetwork):
        raise InputError(f"the network {spec!r} must be a torch.nn.Module with initial_state, step and sequence")
    try_network(f"the network {spec!r}", network, space)
    return network
