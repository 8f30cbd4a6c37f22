"""The goals of a world: their names, the vectors that stand for them, and the one that ends an episode."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.support.arrays import freeze
from hierroom.support.errors import InputError, shown

MAX_GOALS = 63
"""Most goals of a world: the goals that a step achieves are bits of a signed 64-bit integer."""
NO_TARGET = MAX_GOALS
"""In place of a target: the bit of no goal."""
MAX_NAME = 100
"""Most characters of a goal's name, so that a table's cell can list hundreds of goals."""
_OF_OTHERS = re.compile(r"no_goal|new|(50|90|95|99)(_low|_high)?")
"""Names that tables have for other columns: ``reached_new`` and ``steps_to_95``."""


def column_name(goal: str) -> str:
    """Return a goal's name as tables and loggers have it in the names of columns."""
    return goal.replace(" ", "_")


@dataclass(frozen=True, eq=False)
class GoalSet:
    """G goals, numbered from 0; -1 is 'no goal'.

    Args:
        names: [G] names.
        vectors: [G + 1, K] float32, the vector that a controller observes for each goal; the last row is 'no goal'.
        target: the goal that ends an episode with success, or `NO_TARGET`.
        kinds: names of the kinds of goals; training reports for each kind how many options reach their goal.
        kind_of: [G], the kind of each goal.
        milestones: evaluations report the first step of each; a world maps the goals of each episode to them.
        n_alike: number of interchangeable things, such as six colours. Each has a goal of every kind but the last: with
            six, goals 0 to 5 are of the first kind, 6 to 11 of the second, and 12 is the target. 0: none.
    """

    names: tuple[str, ...]
    vectors: NDArray[np.float32]
    target: int
    kinds: tuple[str, ...]
    kind_of: NDArray[np.integer]
    milestones: tuple[str, ...]
    n_alike: int = 0

    def __post_init__(self) -> None:
        if len(self.names) > MAX_GOALS:
            raise InputError(f"a world has at most {MAX_GOALS} goals, not {len(self.names)}")
        columns: dict[str, str] = {}
        for name in self.names:
            if len(name) > MAX_NAME:
                raise InputError(f"the name of a goal has at most {MAX_NAME} characters, not {len(name)}")
            if _OF_OTHERS.fullmatch(column := column_name(name)):
                raise InputError(f"a goal cannot be called {name!r}, because tables have another column {column!r}")
            if (other := columns.setdefault(column, name)) != name:
                raise InputError(f"goals {other!r} and {name!r} would have one column in tables; rename one of them")
        freeze(self)  # all environments of the process share it

    @classmethod
    def one_hot(cls, names: Sequence[str], target: str | None) -> GoalSet:
        """Return goals with these names and one-hot vectors; each goal is a kind and a milestone of its own.

        Without goals 'no goal' is the vector [0].
        """
        names, n = tuple(names), len(names)
        if target not in (*names, None):
            known = f"one of the goals {', '.join(names)}, or None" if names else "None in a task without goals"
            raise InputError(f"the target must be {known}, not {shown(target)}")
        vectors = np.zeros((min(n, MAX_GOALS) + 1, max(n, 1)), np.float32)  # more goals are refused: little memory
        np.fill_diagonal(vectors[:-1], 1)
        return cls(names, vectors, NO_TARGET if target is None else names.index(target), names, np.arange(n), names)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def has_target(self) -> bool:
        """Return whether episodes can succeed."""
        return self.target != NO_TARGET

    @property
    def outcome(self) -> str:
        """Return the column that counts: ``success_rate``; without a target ``score``; without goals ``return``."""
        return "success_rate" if self.has_target else "score" if self.names else "return"

    @property
    def n_choices(self) -> int:
        """Number of a meta-controller's actions: the goals and, as the last action, 'no goal'."""
        return len(self.names) + 1

    @property
    def no_goal_action(self) -> int:
        """The action 'no goal'. When it is not the meta-controller's turn, only this action is legal: it means wait."""
        return len(self.names)
