"""A player that records every decision of its agents."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.player import Pair
from hierroom.learners.policy import Decision
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns


@dataclass(frozen=True, eq=False)
class EpisodeDecisions:
    """The T turns of an agent in one episode.

    Args:
        steps: [T] int, the primitive step at which each turn began, counted from 0.
        probabilities: [T, A] float, the probability of each action.
        values: [T] float, the discounted return that the agent expected.
    """

    steps: NDArray[np.integer]
    probabilities: NDArray[np.floating]
    values: NDArray[np.floating]


class DecisionTape:
    """Lets a pair of agents play in N new environments, and records its decisions."""

    def __init__(self, pair: Pair) -> None:
        self._pair = pair
        self._taken: dict[str, list[tuple[int, NDArray[np.integer], NDArray, NDArray]]] = {}
        self._last: dict[str, Decision | None] = {}
        self._n_steps = 0

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment."""
        step = self._pair.step(turns)
        for name, agent in self._pair.agents.items():
            decision: Decision | None = getattr(agent, "decision", None)  # scripted agents have none
            if decision is not None and decision is not self._last.get(name):
                kept = decision.envs.copy(), decision.probabilities, decision.values.copy()
                self._taken.setdefault(name, []).append((self._n_steps, *kept))
                self._last[name] = decision
        self._n_steps += 1
        return step

    def of_first_episode(self, name: str, env: int, length: int) -> EpisodeDecisions | None:
        """Return an agent's decisions in an environment's first episode, given its length; None if scripted."""
        found = [
            (at, probabilities[row], values[row])
            for at, envs, probabilities, values in self._taken.get(name, ())
            if at < length
            for row in np.flatnonzero(envs == env)
        ]
        if not found:
            return None
        steps, probabilities, values = zip(*found, strict=True)
        return EpisodeDecisions(np.array(steps), np.array(probabilities), np.array(values))
