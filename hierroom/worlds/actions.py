"""The kinds of a controller's actions: numbers, arrays of numbers or flags, and arrays within bounds."""

# `DiscreteActions` documents the methods of all classes:
# ruff: noqa: D102
from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.support.errors import InputError
from hierroom.worlds.world import whole_numbers

MOST_OUTPUTS = 2**16
"""Most outputs of a policy for one action."""
_MOST_SHOWN, _LARGEST = 8, 2**53  # the largest whole number up to which floats are exact


@dataclass(frozen=True)
class DiscreteActions:
    """One of ``n`` actions, numbered from 0; the classes below have the same attributes and methods.

    Attributes:
        n: number of actions; 0 if they are arrays, for which the kernels of turns know only legal and illegal.
        first: the environment's own number of action 0.
        kind: discrete, multi or box, as in `AgentSpace`.
        sizes: number of values of each number of an action; 2 for a number within bounds, its mean and deviation.
        shape: of one action.
        dtype: of actions.
        kept_type: of actions in episodes and checkpoints.
    """

    n: int
    first: int = 0
    kind: ClassVar[Literal["discrete", "multi", "box"]] = "discrete"
    shape: ClassVar[tuple[int, ...]] = ()
    dtype: ClassVar[Any] = np.int64
    kept_type: ClassVar[Any] = np.int32

    @property
    def sizes(self) -> tuple[int, ...]:
        """Return the number of actions."""
        return (self.n,)

    def new_space(self) -> spaces.Space:
        """Return a new space of one action."""
        return spaces.Discrete(self.n)

    def read(self, actions: ArrayLike, n: int) -> NDArray:
        """Return a user's actions [n, ...] as a contiguous array of ``dtype``, or refuse them."""
        return whole_numbers(actions, n)

    def are_legal(self, actions: NDArray) -> NDArray[np.bool_]:
        """Return whether each of N actions exists."""
        return (actions >= 0) & (actions < self.n)

    def codes(self, actions: NDArray) -> NDArray[np.int64]:
        """Return the numbers [N] by which kernels know actions: an array is 0, or 1 if it does not exist."""
        return actions

    def of_policy(self, drawn: NDArray) -> NDArray:
        """Return the actions for a policy's N choices; a Gaussian's are in units in which the bounds are -1 and 1."""
        return drawn

    def for_envs(self, actions: NDArray) -> list[Any]:
        """Return N actions in the form that the environment's own space has."""
        return (self.first + actions).tolist()

    def sample(self, random: np.random.Generator, n: int) -> NDArray:
        """Draw n actions, each as likely as any other."""
        return random.integers(self.n, size=n)

    def name(self, action: Any) -> str:
        """Return the name of an action."""
        return f"action {self.first + int(action)}" if self.are_legal(action) else "illegal action"


class ArrayActions:
    """Actions that are arrays of numbers within bounds; see `DiscreteActions` for attributes and methods."""

    n = 0
    kind: ClassVar[Literal["multi", "box"]]
    sizes: tuple[int, ...]

    def __init__(self, space: Any, low: NDArray, high: NDArray, slack: int) -> None:
        self._space, self.shape, self.dtype = space, tuple(space.shape), np.dtype(space.dtype)
        self._low, self._high = low, high
        self._slack = slack  # numbers further outside act as those at this distance

    @property
    def kept_type(self) -> Any:
        return self.dtype

    def new_space(self) -> spaces.Space:
        return deepcopy(self._space)

    def read(self, actions: ArrayLike, n: int) -> NDArray:
        try:
            given = np.asarray(actions)
        except ValueError:  # rows of unequal lengths
            given = np.array(None)
        if given.shape != (n, *self.shape) or given.dtype.kind not in ("biuf" if self.dtype.kind == "f" else "biu"):
            found = f"{given.dtype} of shape {given.shape}"
            raise InputError(f"actions must be {n} of {self._space}, one for each environment, not {found}")
        return np.ascontiguousarray(np.clip(given, self._low - self._slack, self._high + self._slack), self.dtype)

    def are_legal(self, actions: NDArray) -> NDArray[np.bool_]:
        is_inside = (actions >= self._low) & (actions <= self._high)
        return np.all(is_inside, axis=tuple(range(1, actions.ndim)))

    def codes(self, actions: NDArray) -> NDArray[np.int64]:
        return (~self.are_legal(actions)).astype(np.int64)

    def for_envs(self, actions: NDArray) -> list[Any]:
        return [np.asarray(action) for action in actions.copy()]  # an environment may write to its own

    def sample(self, random: np.random.Generator, n: int) -> NDArray:
        return random.integers(self._low, self._high, (n, *self.shape), endpoint=True).astype(self.dtype)

    def name(self, action: Any) -> str:
        numbers = np.ravel(action).tolist()
        more = ", ..." if len(numbers) > _MOST_SHOWN else ""
        shown = ", ".join(f"{number:.3g}" for number in numbers[:_MOST_SHOWN])
        return f"action [{shown}{more}]" if self.are_legal(np.asarray(action)[None])[0] else "illegal action"


class MultiActions(ArrayActions):
    """Arrays of numbers, as of `MultiDiscrete`, or of flags, as of `MultiBinary`."""

    kind = "multi"

    def __init__(self, space: spaces.MultiDiscrete | spaces.MultiBinary) -> None:
        is_flags = isinstance(space, spaces.MultiBinary)
        sizes = np.full(space.shape, 2) if is_flags else np.asarray(space.nvec, np.int64)
        start = np.zeros(space.shape, np.int64) if is_flags else np.asarray(space.start, np.int64)
        super().__init__(space, start, start + sizes - 1, slack=1)  # so that those outside stay illegal
        self.sizes = tuple(sizes.ravel().tolist())

    def of_policy(self, drawn: NDArray) -> NDArray:
        return (self._low + drawn.reshape(len(drawn), *self.shape)).astype(self.dtype)


class BoxActions(ArrayActions):
    """Arrays within bounds, as of `Box`: numbers outside the bounds act as the nearest bound; NaN does not exist."""

    kind = "box"

    def __init__(self, space: spaces.Box) -> None:
        wide = np.float64 if np.dtype(space.dtype).kind == "f" else np.int64
        super().__init__(space, space.low.astype(wide), space.high.astype(wide), slack=0)
        self.sizes = (2,) * int(np.prod(self.shape))

    def of_policy(self, drawn: NDArray) -> NDArray:
        units = drawn.reshape(len(drawn), *self.shape).astype(np.float64)
        actions = (self._low + self._high) / 2 + (self._high - self._low) / 2 * units
        rounded = actions if self.dtype.kind == "f" else np.rint(actions)
        return np.clip(rounded, self._low, self._high).astype(self.dtype)

    def sample(self, random: np.random.Generator, n: int) -> NDArray:
        is_whole = self.dtype.kind != "f"
        return super().sample(random, n) if is_whole else self.of_policy(random.uniform(-1, 1, (n, *self.shape)))


Actions = DiscreteActions | MultiActions | BoxActions


def actions_in(world: Any) -> Actions:
    """Return the actions of a world or of a task; one with numbers alone needs no attribute ``actions``."""
    return getattr(world, "actions", None) or DiscreteActions(world.n_actions)


def actions_of(space: spaces.Space, task: str, most: int) -> Actions:
    """Return the actions of a task's action space, of at most ``most`` numbers, or refuse it."""
    if isinstance(space, spaces.Discrete):
        if space.n > most:
            raise InputError(f"a task has at most {most} actions; {task} has {space.n}")
        _require_fit(space, int(space.start) + int(space.n) - 1, task)
        return DiscreteActions(int(space.n), int(space.start))
    if not isinstance(space, (spaces.MultiDiscrete, spaces.MultiBinary, spaces.Box)):
        kinds = "Discrete, MultiDiscrete, MultiBinary or Box"
        raise InputError(f"the actions of {task} must be {kinds}, not {space}; wrap its environment")
    if isinstance(space, spaces.Box):
        if space.dtype is None or space.dtype.kind not in "iuf":
            raise InputError(f"Box actions of {task} must be numbers, not {space.dtype}; wrap its environment")
        low, high = space.low.astype(np.float64), space.high.astype(np.float64)
        with np.errstate(over="ignore"):
            is_finite = np.isfinite((high - low).astype(np.float32)).all()
        if not is_finite or (space.dtype.kind != "f" and np.abs([low, high]).max(initial=0) > _LARGEST):
            give = "give it bounds: gymnasium.wrappers.TransformAction(env, lambda action: action, Box(-1, 1, shape))"
            raise InputError(f"the actions of {task} have no scale, as their bounds are not finite ({space}); {give}")
    elif isinstance(space, spaces.MultiDiscrete):
        _require_fit(space, int((space.start.astype(object) + space.nvec.astype(object) - 1).max(initial=0)), task)
    actions = BoxActions(space) if isinstance(space, spaces.Box) else MultiActions(space)
    if not 0 < sum(actions.sizes) <= MOST_OUTPUTS:
        raise InputError(f"actions of {task} need 1 to {MOST_OUTPUTS} outputs of a policy, not {sum(actions.sizes)}")
    return actions


def _require_fit(space: Any, largest: int, task: str) -> None:
    if largest > (most := np.iinfo(space.dtype).max):
        raise InputError(f"the largest action of {task} is {largest}, but {space.dtype} holds {most} ({space})")
