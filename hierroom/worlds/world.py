"""What worlds share: the fields of a step's outcome, features, and the protocol of replayers."""

# Protocol methods have only a docstring.
# pyright: reportReturnType=false
from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.support.arrays import freeze
from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError

_INT64 = np.dtype(np.int64)
OUTCOME_FIELDS = (
    ("achieved", "i8"),  # bit g: this step achieved goal g
    ("n_first", "i4"),  # how many of these goals were achieved for the first time in this episode
    ("is_novel", "?"),  # the agent was not here before since its last achievement; False if visits are not remembered
    ("is_discovery", "?"),  # something relevant came into view for the first time in this episode
    ("reward", "f8"),  # the extrinsic reward
    ("terminated", "?"),
    ("truncated", "?"),
    ("length", "i4"),  # number of steps of the episode so far, this one included
    ("elapsed", "i8"),  # primitive steps that the action took, where the environment reports them, else 0
)
"""Fields of a step's outcome in one environment; the records of a world may have more."""

RENDER_MODES = ("ansi", "rgb_array", "human")
Seeds = int | Sequence[int | None] | None
"""One seed for all environments, a sequence with a seed or None for each, or None: see `BaseWorld.reset`."""


@dataclass(frozen=True)
class Feature:
    """One or more whole numbers that a network can read from an observation.

    Args:
        cardinalities: the number of values of each number.
        encode: function from an observation of M environments to [M, numbers] whole numbers below the cardinalities.
        vectors: [cardinality, d] fixed vectors, one for each value. None: the network learns an embedding.
        memories: what the world must remember for it.
        is_by_goal: whether it has one number for each goal.
        is_of_goal: whether it shows the controller's goal; methods without a visible goal leave it out.
        is_of_world: whether it shows only the world, not the goal or past actions; curiosity reads these features.
        array: layout of the numbers if they are the bytes of an array; None: they are categories.
    """

    cardinalities: tuple[int, ...]
    encode: Callable[[Any], NDArray]
    vectors: NDArray | None = None
    memories: tuple[str, ...] = ()
    is_by_goal: bool = False
    is_of_goal: bool = False
    is_of_world: bool = True
    array: ByteArray | None = None

    def __post_init__(self) -> None:
        freeze(self)  # shared by all agents of the process


class Replayer(Protocol):
    """Replays episodes from their start, names their goals and draws their states.

    A state comes from `BaseWorld.get_state` for one environment. Worlds with `Rules` may add ``rules_state``, a
    function from a state to the achieved goals [G] and the count of each fact [F].
    """

    def identity(self, state: Any) -> tuple[int, int, int]:
        """Return the environments' seed, this one's index, and the number of episodes that it began before."""

    def max_steps(self, state: Any) -> int:
        """Return the number of steps after which the episode is truncated."""

    def goal_name(self, state: Any, goal: int) -> str:
        """Return the name of a goal in this episode; -1 is no goal."""

    def goal_label(self, state: Any, goal: int) -> str:
        """Return a name of a goal that means the same in every episode."""

    def action_name(self, state: Any, action: Any) -> str:
        """Return the name of a controller's action."""

    def replay(self, state: Any, actions: NDArray, drawn: Container[int] | None = None) -> Iterator[Any]:
        """Yield the state, then the state after each action. `picture` draws those numbered in ``drawn``; None: all."""

    def tile_size(self, state: Any) -> int:
        """Return a tile size for pictures with readable text."""

    def window_tile_size(self, state: Any) -> int:
        """Return a tile size for pictures that fit on a screen."""

    def picture(self, state: Any, goal: int, tile_size: int, title: str) -> NDArray[np.uint8]:
        """Draw a state: [H, W, 3] uint8."""

    def text(self, state: Any, goal: int = -1) -> str:
        """Draw a state for a terminal."""


def whole_numbers(actions: ArrayLike, n: int) -> NDArray[np.int64]:
    """Return actions as contiguous [n] int64, without a copy where possible; too large numbers become negative."""
    if type(actions) is np.ndarray and actions.dtype is _INT64 and actions.shape == (n,) and actions.flags.c_contiguous:
        return actions  # the usual case; the checks below take twice as long
    try:
        given = np.asarray(actions)
    except ValueError:  # rows of unequal lengths
        given = np.array(None)
    if given.shape != (n,) or given.dtype.kind not in "iu":
        shown = f"an array of {given.dtype} and shape {given.shape}"
        raise InputError(f"actions must be {n} whole numbers, one for each environment, not {shown}")
    return np.ascontiguousarray(given, np.int64)
