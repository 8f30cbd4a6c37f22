"""Features: the inputs of a network, as small whole numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
from hierroom.worlds.make import WorldSpec
from hierroom.worlds.world import Feature

ENTRY, CHOICE = "features", "choice"
"""The entries of observations that trained agents act by: what a network reads, and the meta-controller's goal."""


def offered(world: WorldSpec) -> dict[str, Feature]:
    """Return all features that networks can read in a world, by name.

    Every world has symbol (the goal as one of G + 1, no goal the last), goal (the same by the goal's vector) and
    previous-action (the controller's last action). For meta-controllers it has goal-outcome: how the last goal's option
    ended, and 0 for other goals.
    """
    n, ids = len(world.goals), np.arange(len(world.goals))

    def goal(vectors: NDArray | None) -> Feature:
        return Feature((n + 1,), lambda o: (o.goals % (n + 1))[:, None], vectors, is_of_goal=True, is_of_world=False)

    return {
        **world.features,
        "goal": world.features.get("goal", goal(world.goals.vectors)),
        "symbol": goal(None),
        "previous-action": Feature((world.n_actions + 1,), lambda o: o.previous_actions[:, None], is_of_world=False),
        "goal-outcome": Feature(
            (N_OUTCOMES,) * n,
            lambda o: np.where(o.goals[:, None] == ids, o.outcomes[:, None], NO_OUTCOME),
            is_by_goal=True,
        ),
    }


@dataclass(frozen=True)
class Features:
    """The features of one agent, side by side.

    Args:
        world: what offers them.
        names: of features, in order.
        agent: who reads them: how the last option ended is for meta-controllers alone.
    """

    world: WorldSpec
    names: Sequence[str]
    agent: str = CONTROLLER

    def __post_init__(self) -> None:
        require_features("features", self.names, offered(self.world))
        if self.agent == CONTROLLER and "goal-outcome" in self.names:
            raise InputError("goal-outcome belongs to meta_features, not to features")

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle only the parts."""
        return Features, (self.world, self.names, self.agent)

    @cached_property
    def _chosen(self) -> list[Feature]:
        known = offered(self.world)
        return [known[name] for name in self.names]

    def subset(self, *, of_goal: bool | None = None, of_world: bool | None = None) -> list[str]:
        """Return the names of those that show the goal or not, or the world or not, where this is given."""
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
        """Return where among the K numbers there are bytes of arrays, and how these are read."""
        arrays, start = [], 0
        for feature in self._chosen:
            if feature.array is not None:
                arrays.append((start, feature.array))
            start += len(feature.cardinalities)
        return tuple(arrays)

    @property
    def vectors(self) -> list[NDArray | None] | None:
        """For each of the K numbers the fixed numbers that stand for its values, if any; None where none has any."""
        vectors = [feature.vectors for feature in self._chosen for _ in feature.cardinalities]
        return None if all(of_number is None for of_number in vectors) else vectors

    @property
    def are_by_goal(self) -> bool:
        """Return whether each has one number for each goal, so that a network can treat all colours alike."""
        return all(feature.is_by_goal for feature in self._chosen)

    @property
    def memories(self) -> tuple[str, ...]:
        """Return the memories of the world that they need."""
        return tuple(memory for feature in self._chosen for memory in feature.memories)

    def encode(self, observation: Observation) -> NDArray[np.uint8]:
        """Return the features of M environments, [M, K] uint8."""
        return np.concatenate(
            [feature.encode(observation) for feature in self._chosen], axis=1, dtype=np.uint8, casting="unsafe"
        )
