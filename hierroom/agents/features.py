"""Features, which are small whole numbers that a network reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.config import require_features
from hierroom.controller import Observation
from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError
from hierroom.turns.kernels import NO_OUTCOME
from hierroom.turns.records import CONTROLLER, N_OUTCOMES
from hierroom.worlds.actions import Actions, DiscreteActions
from hierroom.worlds.make import WorldSpec
from hierroom.worlds.world import Feature

ENTRY, CHOICE = "features", "choice"
"""Observation entries that trained agents act on: inputs of the network, and the meta-controller's choice."""


def offered(world: WorldSpec) -> dict[str, Feature]:
    """Return all features that networks can read in a world, by name.

    Every world has symbol (the goal's number, G for no goal), goal (the goal's vector) and, unless actions are arrays,
    previous-action (the controller's last action). Meta-controllers also have goal-outcome, one number for each goal:
    how the last option ended for its goal, and 0 for all others.
    """
    n, ids = len(world.goals), np.arange(len(world.goals))
    symbol = Feature((n + 1,), lambda o: (o.goals % (n + 1))[:, None], is_of_goal=True, is_of_world=False)
    previous = Feature((world.actions.n + 1,), lambda o: o.previous_actions[:, None], is_of_world=False)
    return {
        **world.features,
        "goal": world.features.get("goal") or replace(symbol, vectors=world.goals.vectors),
        "symbol": symbol,
        **({"previous-action": previous} if world.actions.n else {}),
        "goal-outcome": Feature(
            (N_OUTCOMES,) * n,
            lambda o: np.where(o.goals[:, None] == ids, o.outcomes[:, None], NO_OUTCOME),
            is_by_goal=True,
        ),
    }


def actions_in(world: WorldSpec, agent: str) -> Actions:
    """Return the kind of an agent's actions in a world."""
    return world.actions if agent == CONTROLLER else DiscreteActions(world.goals.n_choices)


@dataclass(frozen=True)
class Features:
    """The features of one agent, concatenated.

    Args:
        world: the spec of the world that offers them.
        names: names of the features, in order.
        agent: the agent that reads them; goal-outcome is only for meta-controllers.
    """

    world: WorldSpec
    names: Sequence[str]
    agent: str = CONTROLLER

    def __post_init__(self) -> None:
        require_features("features", self.names, offered(self.world))
        if self.agent == CONTROLLER and "goal-outcome" in self.names:
            raise InputError("goal-outcome belongs to meta_features, not to features")

    def __reduce__(self) -> tuple[Any, ...]:
        return Features, (self.world, self.names, self.agent)

    @cached_property
    def actions(self) -> Actions:
        """The kind of the agent's actions."""
        return actions_in(self.world, self.agent)

    @cached_property
    def _chosen(self) -> list[Feature]:
        known = offered(self.world)
        return [known[name] for name in self.names]

    def subset(self, *, of_goal: bool | None = None, of_world: bool | None = None) -> list[str]:
        """Return the names of the features with the given flags; None allows either value."""
        return [
            name
            for name, feature in zip(self.names, self._chosen, strict=True)
            if of_goal in (None, feature.is_of_goal) and of_world in (None, feature.is_of_world)
        ]

    @property
    def cardinalities(self) -> tuple[int, ...]:
        """Return the number of values of each of the K numbers."""
        return tuple(c for feature in self._chosen for c in feature.cardinalities)

    @property
    def arrays(self) -> tuple[tuple[int, ByteArray], ...]:
        """Return the start of each array's bytes among the K numbers, and its layout."""
        arrays, start = [], 0
        for feature in self._chosen:
            if feature.array is not None:
                arrays.append((start, feature.array))
            start += len(feature.cardinalities)
        return tuple(arrays)

    def name_at(self, column: int) -> str:
        """Return the name of the feature that has one of the K numbers."""
        ends = np.cumsum([len(feature.cardinalities) for feature in self._chosen])
        return self.names[int(np.searchsorted(ends, column, side="right"))]

    @property
    def vectors(self) -> list[NDArray | None] | None:
        """Return each of the K numbers' fixed vectors for its values, or None for it; None if no number has any."""
        vectors = [feature.vectors for feature in self._chosen for _ in feature.cardinalities]
        return None if all(of_number is None for of_number in vectors) else vectors

    @property
    def are_by_goal(self) -> bool:
        """Return whether each has one number for each goal, so that all colours can share a network."""
        return all(feature.is_by_goal for feature in self._chosen)

    @property
    def memories(self) -> tuple[str, ...]:
        """Return the names of what the world must remember for them."""
        return tuple(memory for feature in self._chosen for memory in feature.memories)

    def encode(self, observation: Observation) -> NDArray[np.uint8]:
        """Return the features of M environments, [M, K] uint8."""
        return np.concatenate(
            [feature.encode(observation) for feature in self._chosen], axis=1, dtype=np.uint8, casting="unsafe"
        )
