"""N workshops that are stepped together, compiled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.support.arrays import freeze, read_only
from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled
from hierroom.support.schema import Whole
from hierroom.support.thread_pool import Shares
from hierroom.worlds.base import OUTCOME, BaseWorld
from hierroom.worlds.env_config import SPLITS, EnvConfig
from hierroom.worlds.seeds import Indices, chosen_envs, write_seeds
from hierroom.worlds.workshop import kernels
from hierroom.worlds.workshop.goal_kernels import GOAL_MASKS
from hierroom.worlds.workshop.layout import SHELF, SHOP, WorkshopState, check_state
from hierroom.worlds.workshop.recipes import book_of
from hierroom.worlds.workshop.tech_tree import tech_tree
from hierroom.worlds.workshop.view import WorkshopView
from hierroom.worlds.world import Feature, Seeds

_KEYS = (*(f"K_{digit}" for digit in "1234567890"), *(f"K_{letter}" for letter in "qwertyuiopasdfghjklzxcvbnm"))


class WorkshopWorld(BaseWorld):
    """N workshops.

    Mission
        Make the target of the rules from things on a shelf. The rules are hidden from the controller.

    Things
        Every fact of the rules is a thing. An episode begins with the facts of the rules' start. A rule that asks for
        nothing, or for the same as another one, has its own source, which is always there. Each thing that some rule
        asks for has a place on the shelf. Each episode draws the order of the places. With five places or more, an
        eighth of the orders is kept for evaluation and never drawn in training. Nothing else is random.

    Actions, P + 2 for P places
        0 to P - 1 put one thing from that place of the shelf on the bench, if there is one and the bench has room. The
        bench holds as many things as the largest rule asks for. P works: it applies the rule if the bench holds exactly
        the things that the rule needs and uses. Used things are gone, needed things go back to the shelf, and given
        things appear there, up to their capacity. Working does nothing where no rule applies or nothing would change. P
        + 1 clears the bench: everything goes back to its place. Any action costs a step. If a rule has several
        alternatives, the one on the bench is applied.

    Goals
        The names of the rules. A goal is achieved each time its rule is applied. A goal of k things takes k + 1 right
        actions, the k in any order. By default the goals that can be made now and would change something are legal.

    Observation
        ``observation`` [P, 3] uint8: for each place the number of its thing, its count on the shelf and its count on
        the bench.

    Reward
        1 for the target, else 0; `hierroom.turns.rewards` has those of the controller.

    End
        Terminated when the target is made. Truncated after ``max_steps``.

    Ids
        ``hierroom/Workshop-v0``, with ``task="workshop:6"`` unless another is given.

    The first argument is the `WorkshopTask`, the others are those of `make_world`.
    """

    can_split = True

    def __init__(self, task: Any, config: EnvConfig, num_envs: int, *, threads: int = 1, **settings: Any) -> None:
        self.task, self.label, self.book, self.rules = task, task.label, task.book, task.rules
        self.replayer = task.replayer
        self.goals, self.n_actions = task.goal_set, task.n_actions
        self.observation_spaces, self.default_max_steps = task.observation_spaces, task.max_steps
        n_places = self.n_actions - 2
        places = dict(zip(_KEYS, range(n_places), strict=False))
        self.keys_to_action: Mapping[str, int] = {**places, "K_SPACE": n_places, "K_BACKSPACE": n_places + 1}
        super().__init__(config, num_envs, **settings)
        self._shares = Shares(num_envs, threads)

    def allocate(self) -> None:
        """Allocate the arrays that change in an episode."""
        num_envs, shops = len(self), np.zeros(len(self), SHOP)
        shops["index"] = self.config.env_index + np.arange(num_envs)
        Whole(1, 2**31 - 1).check(self.max_steps, "max_steps")
        shops["max_steps"], shops["split"] = self.max_steps, SPLITS[self.config.levels]
        things = np.zeros((num_envs, 3, len(self.book.things)), np.uint8)
        self._state = WorkshopState(shops, things)
        self._last_shops, self._last_things = shops.copy(), things.copy()

    @property
    def state(self) -> WorkshopState:
        """The exact state of all environments, read-only."""
        return WorkshopState(*map(read_only, vars(self._state).values()))

    @property
    def features(self) -> Mapping[str, Feature]:
        """Features that networks can read, by name."""
        return self.task.features

    def begin(self, envs: NDArray[np.integer]) -> None:
        """Begin episodes in environments [M]; their records in ``shops`` determine them."""
        part = self._state[envs]
        kernels.begin_shops(part.shops, part.things, self.book.recipes)
        self._write(part, envs)

    def reset(self, seed: Seeds = None, envs: Indices = slice(None)) -> None:
        """Begin the first episode of a seed (0 to 2**63 - 1), or without a seed each environment's next one."""
        chosen = chosen_envs(envs, len(self))
        write_seeds(self._state.shops, seed, chosen)
        self.begin(chosen)
        self._outcomes[chosen] = np.zeros((), OUTCOME)
        self.has_begun = True

    def step(self, actions: NDArray[np.int64]) -> np.ndarray:
        """Take actions [N] and return the outcomes; an action that does not exist only costs the step."""
        state, last = self._state, (self._last_shops, self._last_things)
        recipes, arrays, step = self.book.recipes, (state.shops, state.things), _STEP.run
        if self._shares.is_one:
            step(*arrays, recipes, actions, self._outcomes, *last, self.autoreset)
        else:

            def step_share(p: slice) -> None:
                ours, theirs = (one[p] for one in arrays), (one[p] for one in (actions, self._outcomes, *last))
                step(*ours, recipes, *theirs, self.autoreset)

            self._shares.each(step_share)
        return self._outcomes

    def _view(self, shops: np.ndarray, things: NDArray[np.uint8]) -> WorkshopView:
        return WorkshopView(self.book, self.task.solver, shops, things)

    def _view_now(self) -> WorkshopView:
        return self._view(read_only(self._state.shops), read_only(self._state.things))

    def observe(self, envs: NDArray[np.integer]) -> WorkshopView:
        """Return the view of environments [M], in read-only copies."""
        return freeze(self._view(self._state.shops[envs], self._state.things[envs]))

    def last_view(self, envs: NDArray[np.integer], ended: NDArray[np.bool_]) -> WorkshopView:
        """Return the view of environments [M] after the last step, and before the reset where they ``ended`` [M]."""
        shops, things = self._state.shops[envs], self._state.things[envs]
        if self.autoreset:
            shops[ended], things[ended] = self._last_shops[envs[ended]], self._last_things[envs[ended]]
        return freeze(self._view(shops, things))

    def shown(self, envs: NDArray[np.integer]) -> dict[str, NDArray]:
        """Return the entries of the observations of environments [M], in fresh arrays."""
        return (self._view_now() if envs is self.everywhere else self.observe(envs)).as_dict()

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_], view: Any = None) -> NDArray[np.bool_]:
        """Return the meta-controllers' legal choices [M, G + 1], in a view or everywhere; only 'no goal' off turn."""
        if mask not in GOAL_MASKS:
            raise InputError(f"goal_mask of a workshop is one of {', '.join(GOAL_MASKS)}, not {mask}")
        return (self._view_now() if view is None else view).legal_goals(mask, are_turns)

    def clocks(self) -> NDArray[np.integer]:
        """Return the steps [N] of the current episodes, in a new read-only array."""
        return freeze(self._state.shops["steps"].copy())

    def stagger_clocks(self) -> None:
        """Spread the steps of the current episodes evenly, so that they are not all truncated together."""
        self._state.shops["steps"] = np.arange(len(self)) * self.max_steps // len(self)

    def shortest_lengths(self, envs: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the fewest steps [M] from the current state to the target; -1 if unreachable or unknown."""
        things = self._state.things[envs]
        return np.array([self.task.solver.next_way(one)[0] for one in things], np.int64)

    def shortest_actions(self, env: int) -> NDArray[np.integer]:
        """Return the actions of a shortest path to the target in one environment."""
        return self.task.solver.actions(self._state.things[env])

    def get_state(self, envs: Indices = slice(None)) -> WorkshopState:
        """Copy the exact state of some environments (by default all)."""
        return self._state[chosen_envs(envs, len(self))]

    def state_after(self, before: WorkshopState, actions: ArrayLike) -> WorkshopState:
        """Return the state after the last step; where it ended an episode, repeat it without a reset."""
        state, outcomes = self.get_state(), self._outcomes
        ended = np.flatnonzero(outcomes["terminated"] | outcomes["truncated"])
        if self.autoreset and len(ended):
            last, taken = before[ended], np.asarray(actions, np.int64)[ended]
            within = np.zeros(len(ended), OUTCOME)
            arrays = last.shops, last.things, self.book.recipes, taken, within
            kernels.step_shops(*arrays, last.shops, last.things, False)
            state.shops[ended], state.things[ended] = last.shops, last.things
        return state

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays."""
        return vars(self.get_state(envs))

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays that `get_arrays` of as many environments returned."""
        self.set_state(WorkshopState(**arrays))

    def set_state(self, state: WorkshopState) -> None:
        """Set all environments to a state of as many, which is checked; seeds and indices are part of it."""
        check_state(state, self.book.recipes, len(self))
        self._write(state, self.everywhere)
        shops, outcomes = state.shops, np.zeros(len(self), OUTCOME)
        outcomes["length"] = shops["steps"]
        outcomes["terminated"] = state.things[:, SHELF, self.book.recipes.target] > 0
        outcomes["truncated"] = shops["steps"] >= shops["max_steps"]
        self._outcomes[:] = outcomes
        self.has_begun = True

    def _write(self, state: WorkshopState, envs: NDArray[np.integer]) -> None:
        ours = self._state
        ours.shops[envs], ours.things[envs] = state.shops, state.things


_ARRAYS = np.zeros(1, SHOP), np.zeros((1, 3, 1), np.uint8)
_GIVEN = book_of(tech_tree(2)).recipes, np.zeros(1, np.int64), np.zeros(1, OUTCOME)
_STEP = Compiled(kernels.step_shops, *_ARRAYS, *_GIVEN, *_ARRAYS, True)
