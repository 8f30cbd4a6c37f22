"""The facts of episodes, collected while they are played."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain, compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.turns.records import Step
from hierroom.turns.turns import Turns

Achievements = list[tuple[int, int]]
"""Pairs of a step, counted from 1, and a goal achieved in it."""


@dataclass(frozen=True)
class EndedEpisodes:
    """The facts of E episodes that one step ended.

    Args:
        rows: [E] int, their positions among the stepped environments.
        envs: [E] int, the indices of their environments.
        variants: [E] names of what was played, such as goal graphs.
        successes: [E] bool, whether the target was reached; False without a target.
        lengths: [E] int, numbers of steps.
        shortest: [E] int, the shortest possible lengths, or -1 where not measured.
        returns: [E] float64, sums of the controller's rewards.
        milestones: [E] the achieved milestones of the world, in order.
    """

    rows: NDArray[np.integer]
    envs: NDArray[np.integer]
    variants: list[str]
    successes: NDArray[np.bool_]
    lengths: NDArray[np.integer]
    shortest: NDArray[np.integer]
    returns: NDArray[np.float64]
    milestones: list[Achievements]

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def joined(cls, parts: Sequence[EndedEpisodes]) -> EndedEpisodes:
        """Join the facts of at least one part."""
        columns: Any = ([getattr(part, field.name) for part in parts] for field in fields(cls))
        joined: Any = ([*chain(*one)] if isinstance(one[0], list) else np.concatenate(one) for one in columns)
        return cls(*joined)

    def where(self, chosen: NDArray[np.bool_]) -> EndedEpisodes:
        """Return the facts of some of the episodes, [E] bool."""
        columns: Any = (getattr(self, field.name) for field in fields(self))
        kept: Any = ([*compress(one, chosen)] if isinstance(one, list) else one[chosen] for one in columns)
        return EndedEpisodes(*kept)


class EpisodeFacts:
    """Collects the facts of the current episodes of N environments.

    Attributes:
        returns: [N] float64, sums of the controller's rewards so far.
        achieved: [N] the goals achieved so far.
    """

    def __init__(self, num_envs: int) -> None:
        self.returns = np.zeros(num_envs)
        self.achieved: list[Achievements] = [[] for _ in range(num_envs)]

    def add(
        self,
        step: Step,
        turns: Turns,
        envs: NDArray[np.integer] | None = None,
        counted: NDArray[np.integer] | None = None,
    ) -> EndedEpisodes:
        """Add a step of M environments and return the facts of the episodes that it ended.

        Args:
            step: the step.
            turns: the turns that took the step.
            envs: [M] the indices of these environments; None: they are all N.
            counted: [C] positions among the M; only their ended episodes are returned. None: all.
        """
        numbers = turns.world.everywhere if envs is None else envs
        self.returns[numbers] += step.rewards
        if step.achieved_bits.any():
            for row, goal in np.argwhere(step.achieved).tolist():
                self.achieved[numbers[row]].append((int(step.lengths[row]), goal))
        if not turns.n_ended:
            return _NONE
        facts, ended = _NONE, np.flatnonzero(step.episode_ended)
        rows = ended if counted is None else counted[step.episode_ended[counted]]
        if len(rows):
            envs, world = numbers[rows], turns.world
            achieved = [self.achieved[env] for env in envs.tolist()]
            goals = np.array([goal for one in achieved for _, goal in one], np.int64)
            milestones = iter(world.milestones_of(np.repeat(rows, [len(one) for one in achieved]), goals).tolist())
            numbered = [[(at, next(milestones)) for at, _ in one] for one in achieved]
            of_step = step.success[rows], step.lengths[rows], step.shortest[rows]
            facts = EndedEpisodes(rows, envs, world.variants_of(rows), *of_step, self.returns[envs], numbered)
        self.returns[numbers[ended]] = 0.0
        for env in numbers[ended].tolist():
            self.achieved[env] = []
        return facts


_EMPTY = np.zeros(0, np.int64)
_NONE = EndedEpisodes(_EMPTY, _EMPTY, [], _EMPTY.astype(bool), _EMPTY, _EMPTY, np.zeros(0), [])
