"""A world: N environments that are stepped together, and their goals. Everything above asks this of it, and no more."""

# Methods of protocols have a docstring alone.
# pyright: reportReturnType=false
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.goals import GoalGraph
from hierroom.goals.goal_set import GoalSet
from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError
from hierroom.support.read_only import freeze

_INT64 = np.dtype(np.int64)
OUTCOME_FIELDS = (
    ("achieved", "i8"),  # bit g: this step achieved goal g
    ("n_first", "i4"),  # how many of these goals were achieved for the first time in this episode
    ("is_novel", "?"),  # the agent has not been here before since it last achieved something; False if not remembered
    ("is_discovery", "?"),  # something that matters came into view for the first time in this episode
    ("reward", "f8"),  # the extrinsic reward
    ("terminated", "?"),
    ("truncated", "?"),
    ("length", "i4"),  # number of steps of the episode so far, this one included
)
"""Outcome of a step in one environment; the records of a world may have further fields."""

RENDER_MODES = ("ansi", "rgb_array", "human")
Seeds = int | Sequence[int | None] | None
"""One seed for all environments, one or None for each, or none: see `World.reset`."""


class View(Protocol):
    """The view of M environments at one moment, from which features and observations are made.

    A world adds what its own features and meta-controllers ask for by name. Optional are ``reachable`` [M, G] bool and
    ``depth_first_ranks`` [M, G], by which ``fixed-dfs`` chooses, and ``oracle_goals`` [M], which ``oracle`` gives.
    """

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries by name, [M, ...] each, in fresh arrays."""

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), fixed by seed, environment, episode and turn [M]."""

    def level(self, m: int, legal: NDArray[np.bool_]) -> Any:
        """Return the m-th environment in words; ``legal`` [G] are the goals that may be chosen."""


@dataclass(frozen=True)
class Feature:
    """One thing that a network can read of an observation: one whole number or several.

    Args:
        cardinalities: the number of values of each of its numbers.
        encode: from an observation of M environments to [M, numbers] whole numbers below the cardinalities.
        vectors: [cardinality, d] fixed numbers that stand for each value; None: the network learns a row for each.
        memories: what the world must remember for it.
        is_by_goal: whether it has one number for each goal.
        is_of_goal: whether it shows the controller's goal; methods without a visible goal leave it out.
        is_of_world: whether it shows the world alone, without the goal and past actions; curiosity reads these.
        array: how its numbers are the bytes of an array, where they are no categories.
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
        freeze(self)  # all agents of the process share it


class Replayer(Protocol):
    """Plays episodes again from their start, names their goals and draws their states.

    A state is what `World.get_state` gives for one environment. Optional is ``rules_state``, for worlds with `Rules`:
    from a state to the goals [G] that were achieved, and how many there are of each fact [F].
    """

    def identity(self, state: Any) -> tuple[int, int, int]:
        """Return the seed of the environments, the number of this one, and how many episodes it had begun before."""

    def max_steps(self, state: Any) -> int:
        """Return the number of steps after which the episode is truncated."""

    def goal_name(self, state: Any, goal: int) -> str:
        """Return a goal of this episode in words; -1 is no goal."""

    def goal_label(self, state: Any, goal: int) -> str:
        """Return a goal in words that mean the same in every episode."""

    def action_name(self, state: Any, action: int) -> str:
        """Return an action of the controller in words."""

    def replay(self, state: Any, actions: NDArray[np.integer]) -> Iterator[Any]:
        """Yield the state, and that after each action."""

    def tile_size(self, state: Any) -> int:
        """Return the tile size of a picture in which text can be read."""

    def window_tile_size(self, state: Any) -> int:
        """Return the tile size of a picture that fits on a screen."""

    def picture(self, state: Any, goal: int, tile_size: int, title: str) -> NDArray[np.uint8]:
        """Draw a state: [H, W, 3] uint8."""

    def text(self, state: Any, goal: int = -1) -> str:
        """Draw a state for a terminal."""


class Screen(Protocol):
    """Shows one environment in a render mode."""

    def show(self, env: int, goal: int) -> None:
        """Update the window, if there is one."""

    def render(self, env: int, goal: int) -> str | NDArray[np.uint8] | None:
        """Return text, a picture [H, W, 3] uint8 or None, as the mode asks."""

    def close(self) -> None:
        """Close the window, if one is open."""


class BatchWriter(Protocol):
    """Writes what all N environments show their controllers, all actions legal.

    Attributes:
        flat_space: the space of one environment's observation as a row of numbers, ordered as Gymnasium's `flatten`.
    """

    flat_space: spaces.Box

    def empty(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        """Return new arrays for `write`, and the same arrays by name; no names where observations are flat."""

    def write(self, goals: NDArray[np.integer], arrays: tuple[NDArray, ...]) -> None:
        """Write what the environments show now, with goals [N], into arrays that `empty` gave."""

    def write_goals(self, observations: Any, goals: NDArray[np.integer], envs: NDArray[np.integer]) -> None:
        """Write the vectors of goals [N] into the observations of some environments."""


class World(Protocol):
    """N environments that are stepped together. A world may lack what stands under 'Optional' below.

    Attributes:
        goals: the goals.
        rules: what must be achieved before what; of several goal graphs, the hardest. None: unknown.
        n_actions: number of the controller's actions.
        features: the features that networks can read, by name.
        replayer: plays episodes again and draws them.
        observation_spaces: the spaces of the entries of `View.as_dict`, of one environment.
        keys_to_action: the controller's action for each key of the keyboard, by pygame's constants such as ``K_UP``.
        outcomes: [N] records with the fields of `OUTCOME_FIELDS`, overwritten by each step.
        variants: names of the kinds of episodes that the world draws from, the easiest first.
        stage_titles: a line for each stage of a curriculum; empty without one.
        notes: lines that a user should know before a run goes on.
        everywhere: [N] int, the numbers of all environments, read-only.
        has_begun: whether the first `reset` was made.
        can_split: whether each environment goes on as it would if it were copied into a world of fewer environments.
    """

    goals: GoalSet
    rules: GoalGraph | None
    n_actions: int
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
        """Begin an episode: with a seed an environment's first one, without one its next."""

    def remember(self, memories: Iterable[str]) -> None:
        """Remember more of each episode from the next `reset` on: what features and rewards name."""

    def step(self, actions: NDArray[np.int64]) -> np.ndarray:
        """Act once in every environment and return the outcomes; an action [N] that is none only costs the step."""

    def clocks(self) -> NDArray[np.integer]:
        """Return [N] the steps of the episodes under way."""

    def stagger_clocks(self) -> None:
        """Spread the steps of the episodes under way evenly, so that they are not all truncated together."""

    def observe(self, envs: NDArray[np.integer]) -> View:
        """Return the view of environments [M]; if they are all, the next step may overwrite it."""

    def last_view(self, envs: NDArray[np.integer], ended: NDArray[np.bool_]) -> View:
        """Return the view of environments [M] after the last step; of those that ``ended`` [M], before the reset."""

    def exact_view(self, envs: NDArray[np.integer]) -> View:
        """Return a copied view of environments [M], with all facts for meta-controllers."""

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_], view: Any = None) -> NDArray[np.bool_]:
        """Return the meta-controllers' legal actions [M, G + 1], of a view or of all; off turn they can only wait."""

    def observe_one(self, goal: int) -> dict[str, Any]:
        """Return the observation of the only environment: `View.as_dict` and ``goal``, the goal's vector."""

    def batch_observations(self, *, flat: bool) -> BatchWriter:
        """Return the writer of the observations of all environments, each one row of numbers if ``flat``."""

    def screen(self, render_mode: str | None) -> Screen:
        """Return a screen for environments in one of `RENDER_MODES`; None shows nothing."""

    def variants_of(self, envs: NDArray[np.integer]) -> list[str]:
        """Return the variant of the episode that ended last in environments [M]."""

    def milestones_of(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the milestones [M] that goals [M] were in the episodes that ended last in environments [M]."""

    def possible_milestones(self, variants: Sequence[str]) -> list[int]:
        """Return the milestones that episodes of these variants have."""

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays."""

    def check_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Refuse arrays that `get_arrays` of as many such environments cannot have given."""

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go back to what `get_arrays` gave, after `check_arrays`."""

    # Optional: exact states, for recorded episodes and for rewards that ask for states.

    def get_state(self, envs: Any = slice(None)) -> Any:
        """Copy the exact state of some environments."""

    def state_after(self, before: Any, actions: NDArray[np.int64]) -> Any:
        """Return the state to which the last step led from state ``before``, without resets."""

    def graph_of(self, start: Any) -> GoalGraph:
        """Return the goal graph of the state of one environment."""

    # Optional: what only a solver of the world can say, for shortest lengths and for the oracle.

    def shortest_lengths(self, envs: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the fewest steps [M] in which environments [M] can reach the target from now on."""

    def shortest_actions(self, env: int) -> NDArray[np.integer]:
        """Return the actions of a shortest way to the target in one environment."""

    # Optional: the nodes of the augmented graph, for a chain that is measured from play; the global state, for critics.

    def node_map(self, augmented: Any) -> Any:
        """Return what `nodes` needs to find the nodes of an `AugmentedGraph`."""

    def nodes(self, node_map: Any, *, terminated: NDArray[np.bool_], ended: NDArray[np.bool_]) -> NDArray[np.integer]:
        """Return each environment's node [N] after a step, or at the end of the episode that it ended."""

    @property
    def global_state_space(self) -> spaces.Box:
        """The space of `global_state`."""

    def global_state(self, goal: int) -> NDArray:
        """Return the whole state of the only environment and the goal that is pursued, or -1."""


def whole_numbers(actions: ArrayLike, n: int) -> NDArray[np.int64]:
    """Return actions as contiguous [n] int64, the same array if it is such; a number too large becomes negative."""
    if type(actions) is np.ndarray and actions.dtype is _INT64 and actions.shape == (n,) and actions.flags.c_contiguous:
        return actions  # as nearly everyone gives them; what follows takes twice as long
    try:
        given = np.asarray(actions)
    except ValueError:  # rows of unequal lengths
        given = np.array(None)
    if given.shape != (n,) or given.dtype.kind not in "iu":
        shown = f"an array of {given.dtype} and shape {given.shape}"
        raise InputError(f"actions must be {n} whole numbers, one for each environment, not {shown}")
    return np.ascontiguousarray(given, np.int64)
