"""Checks of a learner's state before it is restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from torch import nn

from hierroom.learners.distributions import Categorical, distribution_of
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.support.schema import RANDOM_STATE, Items, Schema, Table, Whole, like, require

_MOST = 2**31


def weights_schema(network: nn.Module) -> Table:
    """Return the schema of a learner's state that checks only the weights of a network."""
    return Table({"backend": Table({"network": _network_schema(network)}, is_open=True)}, is_open=True)


def _network_schema(network: nn.Module) -> Table:
    finite = dict(network.named_parameters())  # buffers may hold any numbers
    return Table({name: like(value, is_finite=name in finite) for name, value in network.state_dict().items()})


def check_learner_state(
    state: Any,
    own: Mapping[str, Any],  # the learner's current state, which has the same shapes
    network: nn.Module,
    space: AgentSpace,
) -> None:
    """Check the types, shapes and ranges of a state, and that its turns are consistent."""
    arrays = own["rollout"]["arrays"]
    length, capacity = arrays["log_probs"].shape
    distribution = distribution_of(space)
    columns = Items(Whole(0, capacity - 1), 0, capacity)
    bounds = {
        "features": (0, np.array(space.cardinalities) - 1),
        "actions": distribution.bounds,
        "elapsed": (1, _MOST),
        "columns": (-1, capacity - 1),
        "turns": (0, length - 1),
        "awaiting": (-1, capacity - 1),
    }
    rollout: dict[str, Schema] = {name: like(array, *bounds.get(name, ())) for name, array in arrays.items()}
    moments = {"means": like(own["backend"]["means"]), "squares": like(own["backend"]["squares"], 0)}
    Table(
        {
            "backend": Table({"network": _network_schema(network), **moments, "n_steps": Whole(0, _MOST)}),
            "rollout": Table({"arrays": Table(rollout), "free": columns, "full": columns}),
            **{name: like(own[name]) for name in ("returns", "return_sums") if name in own},
            "states": like(own["states"]),
            "starts_episode": like(own["starts_episode"]),
            "action_random": RANDOM_STATE,
            "shuffle_random": RANDOM_STATE,
        }
    ).check(state, "learner")
    _check_columns(state["rollout"], distribution)


def _check_columns(rollout: Mapping[str, Any], distribution: Categorical) -> None:
    arrays = {name: tensor.numpy() for name, tensor in rollout["arrays"].items()}
    columns, turns, is_open, awaiting = (arrays[name] for name in ("columns", "turns", "is_open", "awaiting"))
    masks, actions = arrays["masks"], arrays["actions"]
    writes, waits = columns >= 0, awaiting >= 0
    n_begun = np.zeros(actions.shape[1], np.int64)  # turns in each column, including an open one
    n_begun[rollout["full"]] = len(actions)
    n_begun[columns[writes]] = (turns + is_open)[writes]
    is_turn = np.arange(len(actions))[:, None] < n_begun
    in_use = sorted([*rollout["free"], *rollout["full"], *columns[writes].tolist()])
    is_legal = distribution.are_legal(masks, actions)
    require(
        {
            "each of its columns is free, full or one environment's": in_use == [*range(len(n_begun))],
            "an environment that writes no column has begun no turn": writes | ~(is_open | (turns > 0)),
            "columns that await a value are full": np.isin(awaiting, rollout["full"]) | ~waits,
            "no two environments await a value for the same column": len(np.unique(awaiting[waits])) == waits.sum(),
            "the actions of its turns were legal": bool((is_legal | ~is_turn).all()),
        },
        "the rollout of a learner",
    )
