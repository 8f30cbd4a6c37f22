"""A world: N environments that are stepped together, and their goals. Other code uses only this."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.goals.goal_set import GoalSet
from hierroom.support.arrays import Shown, freeze
from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled
from hierroom.support.schema import Array, Table, record_type
from hierroom.worlds.base_view import BaseView
from hierroom.worlds.dependencies import Dependencies, rules_by_goal
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, EnvConfig
from hierroom.worlds.observation_writer import ObservationWriter
from hierroom.worlds.outcome_kernel import begin_episodes, write_outcomes
from hierroom.worlds.seeds import chosen_envs, write_seeds
from hierroom.worlds.window import StateScreen
from hierroom.worlds.world import OUTCOME_FIELDS, Feature, Seeds

OUTCOME = record_type(*OUTCOME_FIELDS)
GOAL_MASKS = ("reachable", "existing", "none")
_ARRAYS = ("seeds", "indices", "numbers", "counts", "markings", "lengths", "has_ended")
_MOST = 2**62


class BaseWorld:
    """N environments; a subclass steps them together or one after the other.

    A subclass defines ``goals``, ``n_actions``, ``features`` and ``observation_spaces``, and the methods `begin`,
    `shown` and `step`. Its `step` finds out what was achieved and calls `record`. All else has a default.

    Attributes (read-only; a leading ``_`` names the writable array):
        seeds, indices, numbers: [N] int; with the split they determine each environment's episode: see `random`.
        counts: [N, G] int, how often each goal was achieved in the current episode.
        markings: [N, F] int, the current count of each fact of the rules.
        lengths: [N] int, steps of the current episode.
    """

    goals: GoalSet
    n_actions: int  # of the controller; 0 if its actions are arrays, and then it has ``actions``, their kind
    features: Mapping[str, Feature]  # that networks can read, by name
    observation_spaces: dict[str, spaces.Space]  # of the entries of a view's ``as_dict``, for one environment
    rules: Any = None  # the dependencies between goals; if there are several goal graphs, the hardest one
    action_masks: NDArray[np.bool_] | None = None  # [N, A] the controller's legal actions now; None: all are
    replayer: Any = None  # replays episodes and draws them: a `Replayer`
    is_repeatable: Any = True
    """True if an achieved goal may be chosen again where no rules are known: flags [G], or one for all goals."""
    keys_to_action: Mapping[str, int] = {}  # by pygame's names of keys, such as ``K_UP``
    stage_titles: Sequence[str] = ()  # a line for each stage of a curriculum
    notes: Sequence[str] = ()  # lines to show the user before a run is resumed
    stage = 0  # of the curriculum
    can_split = False  # whether an environment copied into a smaller world goes on exactly as in this one
    state_after: Any = None  # optional: a function of a state and actions, for rewards that ask for states
    default_max_steps, label = DEFAULT_MAX_STEPS, None  # the name in titles and tables, if the user gave one
    outcomes, seeds, indices, numbers = Shown(), Shown(), Shown(), Shown()
    _seeds, _indices, _numbers = (property(lambda self, n=n: self._episodes[:, n]) for n in range(3))
    counts, markings, lengths, has_ended = Shown(), Shown(), Shown(), Shown()

    def __init__(
        self,
        config: EnvConfig,
        num_envs: int,
        *,
        seed: int | None = None,
        autoreset: bool = True,
        threads: int = 1,
        memories: Iterable[str] = (),
    ) -> None:
        self.config, self.autoreset, self.has_begun = config, autoreset, False
        self.max_steps = config.max_steps or self.default_max_steps
        self.variants: tuple[str, ...] = (self.label,) if self.label else config.names
        self.everywhere: NDArray[np.integer] = freeze(np.arange(num_envs))
        self._outcomes = np.zeros(num_envs, OUTCOME)
        self.allocate()
        self.remember(memories)
        if seed is not None:
            self.reset(seed)

    def __len__(self) -> int:
        return len(self.everywhere)

    def allocate(self) -> None:
        """Allocate the arrays that change in an episode; to override it, override all methods that use them."""
        num_envs = len(self)
        self._episodes, self._lengths = np.zeros((num_envs, 3), np.int64), np.zeros(num_envs, np.int64)
        self._indices[:] = self.config.env_index + np.arange(num_envs)
        self._counts = np.zeros((num_envs, len(self.goals)), np.int64)
        self._given = np.zeros_like(self._counts), np.zeros(num_envs), *np.zeros((2, num_envs), bool)
        self.dependencies = Dependencies.of(self.rules, self.goals)
        self._start = np.zeros(0, np.int64) if self.dependencies is None else self.dependencies.rules.start_marking
        self._markings = np.tile(self._start, (num_envs, 1))
        self._has_ended = np.zeros(num_envs, bool)
        self._ended: tuple[NDArray[np.integer], Any] = self.everywhere[:0], None
        """Environments of the last step that ended episodes, and their view at the end."""

    def begin(self, envs: NDArray[np.integer]) -> None:
        """Begin episodes in environments [M]; ``seeds``, ``indices`` and ``numbers`` determine them."""
        raise NotImplementedError

    def shown(self, envs: NDArray[np.integer]) -> dict[str, NDArray]:
        """Return the current observation entries of environments [M] by name, as new arrays [M, ...]."""
        raise NotImplementedError

    def step(self, actions: NDArray) -> np.ndarray:
        """Act once in every environment, `record` the results, and return the outcomes."""
        raise NotImplementedError

    def get_state(self, envs: Any = slice(None)) -> Any:
        """Return one environment's state, for its replayer; not available by default."""
        raise InputError(f"{self.variants[0]} has no states to copy or to draw")

    @property
    def complexity(self) -> Any:
        """Measure how hard the rules are to explore: a report, or one for each goal without a target, or None."""
        if self.rules is None:
            return None
        from hierroom.complexity.report import analyze

        if self.goals.has_target:
            return analyze(self.rules)
        return {goal: analyze(one) for goal, one in rules_by_goal(self.rules).items()}

    def remember(self, memories: Iterable[str]) -> None:
        """Refuse all memories; only features and rewards of EscapeRooms ask for any."""
        if names := ", ".join(memories):
            names += "; ppo-rnd rewards novelty without it" * (names == "visited")
            raise InputError(f"{self.variants[0]} does not remember what a feature or a reward asks for: {names}")

    def reset(self, seed: Seeds = None, envs: Any = slice(None)) -> None:
        """Begin the first episode of a seed (0 to 2**63 - 1), or without a seed each environment's next one."""
        chosen = chosen_envs(envs, len(self))
        if seed is not None:
            write_seeds({"seed": self._seeds, "episode": self._numbers}, seed, chosen)
        self._outcomes.put(chosen, np.zeros((), OUTCOME))  # an assignment would copy field by field
        self.has_begun = True
        self._begin_next(chosen)

    def _begin_next(self, envs: NDArray[np.integer]) -> None:
        kept = self._episodes, self._counts, self._lengths, self._has_ended, self._markings
        _BEGIN.run(envs, *kept, self._start)
        self.begin(envs)

    def record(
        self,
        times: NDArray[np.bool_] | NDArray[np.integer],
        rewards: NDArray[np.floating],
        terminated: NDArray[np.bool_],
        truncated: NDArray[np.bool_] | bool = False,
    ) -> np.ndarray:
        """Write the results of a step into the outcomes; with autoreset begin the next episode where one ended.

        Results do not count where the episode had already ended.

        Args:
            times: [N, G] how often the step achieved each goal; the target ends an episode.
            rewards: [N] the extrinsic rewards.
            terminated: [N] where the step ended the episode.
            truncated: [N] where something other than the step limit cut the episode off.
        """
        outcomes, given = self._outcomes, self._given
        given[0][...], given[1][:], given[2][:], given[3][:] = times, rewards, terminated, truncated
        kept = self._counts, self._lengths, self._has_ended, outcomes
        n_achieved, n_ended = _OUTCOMES.run(*given, *kept, self.max_steps, self.goals.target, self.autoreset)
        if n_achieved and self.dependencies is not None:
            self.dependencies.apply(self._markings, given[0])
        if n_ended and self.autoreset:
            (ended,) = (outcomes["terminated"] | outcomes["truncated"]).nonzero()
            self._ended = ended, self.observe(ended)
            self._begin_next(ended)
        return outcomes

    def observe(self, envs: NDArray[np.integer]) -> Any:
        """Return the view of environments [M]."""
        return self._view(envs, self.shown(envs))

    def _view(self, envs: NDArray[np.integer], entries: Mapping[str, NDArray]) -> Any:
        facts = self.goals, self.dependencies, self.is_repeatable, self.config.levels, entries
        arrays = self._counts, self._markings, self._lengths, self._episodes
        return BaseView(*facts, *(self.rows(array, envs) for array in arrays))

    def rows(self, array: NDArray, envs: NDArray[np.integer]) -> NDArray:
        """Return the rows of environments [M], in a new array."""
        return array.copy() if envs is self.everywhere else array.take(envs, axis=0)  # it takes a third of the time

    def exact_view(self, envs: NDArray[np.integer]) -> Any:
        """Return a copied view of environments [M], with all facts for meta-controllers."""
        return self.observe(envs)

    def last_view(self, envs: NDArray[np.integer], ended: NDArray[np.bool_]) -> Any:
        """Return the view of environments [M] after the last step, and before the reset where they ``ended`` [M]."""
        now = self.observe(envs)
        if not (self.autoreset and ended.any()):
            return now
        return now.merged(self._ended[1], ended, np.searchsorted(self._ended[0], envs[ended]))

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_], view: Any = None) -> NDArray[np.bool_]:
        """Return the meta-controllers' legal choices [M, G + 1] for a view, or for all environments.

        'No goal' is legal only where no goal is, so it is the only legal choice off turn.
        """
        if mask not in GOAL_MASKS:
            raise InputError(f"goal_mask of {self.variants[0]} is one of {', '.join(GOAL_MASKS)}, not {mask}")
        view = self._view(self.everywhere, {}) if view is None else view  # masks are the same without observations
        legal = np.zeros((len(view), self.goals.n_choices), bool)
        allowed = True if mask == "none" else getattr(view, mask)
        legal[:, :-1] = allowed & are_turns[:, None]
        legal[:, -1] = ~np.logical_or.reduce(legal[:, :-1], axis=1)  # faster than its method
        return legal

    def observe_one(self, goal: int) -> dict[str, Any]:
        """Return the observation of the only environment, and the goal's vector."""
        shown = {name: array[0] for name, array in self.shown(self.everywhere).items()}
        return {**shown, "goal": self.goals.vectors[goal].copy()}

    def batch_observations(self) -> ObservationWriter:
        """Return the writer of the observations of all environments."""
        return ObservationWriter(self)

    def screen(self, render_mode: str | None) -> StateScreen:
        """Return a screen for environments in a render mode."""
        return StateScreen(self.get_state, self.replayer, render_mode)

    def close(self) -> None:
        """Do nothing, by default."""

    def clocks(self) -> NDArray[np.integer]:
        """Return the steps [N] of the current episodes, in a new read-only array."""
        return freeze(self._lengths.copy())

    def stagger_clocks(self) -> None:
        """Spread the steps of the current episodes evenly, so that they are not all truncated together."""
        self._lengths[:] = np.arange(len(self)) * self.max_steps // len(self)

    def shortest_lengths(self, envs: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return -1 for environments [M]: the shortest lengths are unknown."""
        return np.full(len(envs), -1)

    def shortest_actions(self, env: int) -> NDArray[np.integer]:
        """Refuse to solve an environment."""
        raise InputError(f"{self.variants[0]} has no oracle: its shortest solutions are unknown")

    def variants_of(self, envs: NDArray[np.integer]) -> list[str]:
        """Return the name of the graph, layout or task of each of environments [M]."""
        return [self.variants[0]] * len(envs)

    def milestones_of(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return goals [M] unchanged: each is a milestone."""
        return goals

    def possible_milestones(self, variants: Sequence[str]) -> list[int]:
        """Return all goals."""
        return [*range(len(self.goals))]

    def graph_of(self, start: Any) -> Any:
        """Return the rules of an episode, or None."""
        return self.rules

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays; a subclass adds its own."""
        return {name: getattr(self, f"_{name}")[envs] for name in _ARRAYS}

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays that `get_arrays` returned; a subclass does so with its own."""
        n, limits = len(self), None if self.dependencies is None else self.dependencies.rules.limits
        schema = {name: Array(np.int64, (n,), 0, _MOST) for name in ("indices", "numbers")}
        schema |= {"seeds": Array(np.int64, (n,), 0), "lengths": Array(np.int64, (n,), 0, self.max_steps)}
        schema |= {"has_ended": Array(np.bool_, (n,)), "counts": Array(np.int64, self._counts.shape, 0, _MOST)}
        schema["markings"] = Array(np.int64, self._markings.shape, 0, limits)
        Table(schema, is_open=True).check(arrays, "world")
        for name in _ARRAYS:
            getattr(self, f"_{name}")[:] = arrays[name]
        self._outcomes[:] = 0
        self._outcomes["length"] = self._lengths
        self.has_begun = True


_FLAG, _NUMBERS = np.zeros(1, bool), np.zeros((1, 1), np.int64)
_GIVEN, _KEPT = (_NUMBERS, np.zeros(1), _FLAG, _FLAG), (_NUMBERS, _NUMBERS[0], _FLAG, np.zeros(1, OUTCOME))
_OUTCOMES = Compiled(write_outcomes, *_GIVEN, *_KEPT, 1, 0, True)
_BEGIN = Compiled(begin_episodes, _NUMBERS[0], _NUMBERS, *_KEPT[:3], _NUMBERS, _NUMBERS[0])
