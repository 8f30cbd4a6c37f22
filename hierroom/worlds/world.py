"""The protocol of a world: N environments that are stepped together, and their goals. Other code uses only this."""

# Protocol methods have only a docstring.
# pyright: reportReturnType=false
from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.goals.goal_set import GoalSet
from hierroom.support.arrays import freeze
from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError
from hierroom.worlds.observation_writer import ObservationWriter

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
"""One seed for all environments, a sequence with a seed or None for each, or None: see `World.reset`."""


class View(Protocol):
    """The view of M environments at one moment, from which features and observations are computed.

    A world adds attributes for its own features and meta-controllers. Optional: ``reachable`` [M, G] bool and
    ``depth_first_ranks`` [M, G] for ``fixed-dfs``, and ``oracle_goals`` [M] for ``oracle``.
    """

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries by name, [M, ...] each, in fresh arrays."""

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), determined by seed, environment, episode and turn [M]."""

    def level(self, m: int, legal: NDArray[np.bool_]) -> Any:
        """Return the m-th environment in words; ``legal`` [G] marks the goals that may be chosen."""


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

    A state comes from `World.get_state` for one environment. Worlds with `Rules` may add ``rules_state``: a function
    from a state to the achieved goals [G] and the count of each fact [F].
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


class World(Protocol):
    """N environments that are stepped together. A world may lack the methods under 'Optional' below.

    Attributes:
        goals: the goals.
        rules: the dependencies between goals; if there are several goal graphs, the hardest one. None: unknown.
        n_actions: number of the controller's actions; 0 if they are arrays, and then it has ``actions``, their kind.
        action_masks: [N, A] bool, the controller's legal actions now; None: all are.
        features: the features that networks can read, by name.
        replayer: replays episodes and draws them.
        observation_spaces: the spaces of the entries of `View.as_dict` for one environment.
        keys_to_action: the controller's action for each key of the keyboard, by pygame's constants such as ``K_UP``.
        outcomes: [N] records with the fields of `OUTCOME_FIELDS`, overwritten by each step.
        variants: names of the kinds of episodes that the world draws from, the easiest first.
        stage_titles: a line for each stage of a curriculum; empty without one.
        notes: lines to show the user before a run is resumed.
        everywhere: [N] int, the indices of all environments, read-only.
        has_begun: whether `reset` was called.
        can_split: whether an environment copied into a smaller world goes on exactly as in this one.
    """

    goals: GoalSet
    rules: Any
    n_actions: int
    action_masks: NDArray[np.bool_] | None
    features: Mapping[str, Feature]
    replayer: Replayer
    observation_spaces: dict[str, spaces.Space]
    keys_to_action: Mapping[str, int]
    outcomes: np.ndarray
    variants: tuple[str, ...]
    stage_titles: Sequence[str]
    notes: Sequence[str]
    everywhere: NDArray[np.integer]
    has_begun: bool
    can_split: bool

    def __len__(self) -> int: ...

    @property
    def stage(self) -> int:
        """The current stage of the curriculum, counted from 0."""

    @property
    def complexity(self) -> Any:
        """Measure how hard the environments are to explore, or None if no rules are known."""

    def reset(self, seed: Seeds = None, envs: Any = slice(None)) -> None:
        """Begin the first episode of a seed, or without a seed each environment's next one."""

    def remember(self, memories: Iterable[str]) -> None:
        """From the next `reset` on, remember also these parts of each episode, which features and rewards name."""

    def step(self, actions: NDArray) -> np.ndarray:
        """Take actions [N, ...] and return the outcomes; an action that does not exist only costs the step."""

    def clocks(self) -> NDArray[np.integer]:
        """Return the steps [N] of the current episodes, in a new read-only array."""

    def stagger_clocks(self) -> None:
        """Spread the steps of the current episodes evenly, so that they are not all truncated together."""

    def observe(self, envs: NDArray[np.integer]) -> View:
        """Return the view of environments [M], in arrays that later steps do not change."""

    def last_view(self, envs: NDArray[np.integer], ended: NDArray[np.bool_]) -> View:
        """Return the view of environments [M] after the last step, and before the reset where they ``ended`` [M]."""

    def exact_view(self, envs: NDArray[np.integer]) -> View:
        """Return a copied view of environments [M], with all facts for meta-controllers."""

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_], view: Any = None) -> NDArray[np.bool_]:
        """Return the meta-controllers' legal choices [M, G + 1], in a view or everywhere; only 'no goal' off turn."""

    def observe_one(self, goal: int) -> dict[str, Any]:
        """Return the observation of the only environment: `View.as_dict` and ``goal``, the goal's vector."""

    def batch_observations(self, *, flat: bool) -> ObservationWriter:
        """Return a writer of the observations of all environments, as one row of numbers each if ``flat``."""

    def screen(self, render_mode: str | None) -> Any:
        """Return a `StateScreen` for environments in one of `RENDER_MODES`; None shows nothing."""

    def close(self) -> None:
        """Close what the world holds, such as the environments of a task."""

    def variants_of(self, envs: NDArray[np.integer]) -> list[str]:
        """Return the variant of the episode that ended last in environments [M]."""

    def milestones_of(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the milestones [M] of goals [M] in the episodes that ended last in environments [M]."""

    def possible_milestones(self, variants: Sequence[str]) -> list[int]:
        """Return the milestones that episodes of these variants have."""

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays."""

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays of `get_arrays` from as many such environments; set nothing if they are invalid."""

    # Optional: exact states, for recorded episodes and for rewards that ask for states.
    def get_state(self, envs: Any = slice(None)) -> Any:
        """Copy the exact state of some environments."""

    def state_after(self, before: Any, actions: NDArray) -> Any:
        """Return the state after the last step from state ``before``, without resets."""

    def graph_of(self, start: Any) -> Any:
        """Return the goal graph or the rules of the state of one environment, if known."""

    # Optional: results of a solver, for shortest lengths and for the oracle.
    def shortest_lengths(self, envs: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the fewest steps [M] from the current state to the target in environments [M]."""

    def shortest_actions(self, env: int) -> NDArray[np.integer]:
        """Return the actions of a shortest path to the target in one environment."""

    # Optional: the global state, for critics.
    @property
    def global_state_space(self) -> spaces.Box:
        """The space of `global_state`."""

    def global_state(self, goal: int) -> NDArray:
        """Return the full state of the only environment, with the pursued goal (-1: none)."""


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
