"""Two agents taking turns in N rooms: the rooms, the ledger of the turns, and what either agent is shown.

The AEC, parallel and Gymnasium environments and the trainer are views of this one class, so they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.controller import NOVELTY_BONUS, PAYS, Sight, observation_spaces, observe
from hierroom.errors import InputError
from hierroom.goals import N_GOALS, NO_GOAL
from hierroom.ledger import Ledger, beginning
from hierroom.meta import MetaController
from hierroom.situation import GOAL_MASKS, Situation
from hierroom.step import N_OUTCOMES, Step
from hierroom.world.batch import Batch
from hierroom.world.kernels import turn_draws
from hierroom.world.layout import State
from hierroom.world.oracle import shortest_lengths

NO_GOAL_ACTION = N_GOALS
"""The meta-controller's 14th action: no goal. While it is not its turn, this is the one it may take: wait."""
N_META_ACTIONS = N_GOALS + 1


class Turns:
    """Two agents taking turns in a batch of N rooms.

    Args:
        world: the rooms; the turns own their stepping from here on.
        pay: how the controller is paid, a name in `PAYS`.
        novelty_bonus: the size of the bonus, where the pay is for novelty.
        subgoal_horizon: steps after which a goal's life ends unreached, or None for never.
        goal_mask: which goals are legal, a name in `GOAL_MASKS`.
        autoreset: whether a room whose episode ends begins its next one in the same step.
        measure_shortest: whether each episode's shortest length is found (about a millisecond an episode).

    Attributes:
        ledger: who is to act in each room, and what else there is to know of the turns.

    Raises:
        InputError: if a name is unknown, the bonus is negative or the horizon is not at least 1.
    """

    def __init__(
        self,
        world: Batch,
        *,
        pay: str = "extrinsic",
        novelty_bonus: float = NOVELTY_BONUS,
        subgoal_horizon: int | None = None,
        goal_mask: str = "reachable",
        autoreset: bool = True,
        measure_shortest: bool = False,
    ):
        for what, value, known in (("pay", pay, PAYS), ("goal_mask", goal_mask, GOAL_MASKS)):
            if value not in known:
                raise InputError(f"{what} is one of {', '.join(known)}, not {value!r}")
        if subgoal_horizon is None:
            subgoal_horizon = np.iinfo(np.int64).max
        elif not isinstance(subgoal_horizon, (int, np.integer)) or subgoal_horizon < 1:
            raise InputError(f"subgoal_horizon must be a whole number of at least 1 or None, not {subgoal_horizon!r}")
        self.world = world
        self.pay = replace(PAYS[pay], novelty_bonus=novelty_bonus)
        self.ledger = Ledger.of_beginnings(len(world), world.n_actions)
        self._subgoal_horizon = int(subgoal_horizon)
        self._goal_mask = GOAL_MASKS[goal_mask]
        self._autoreset = autoreset
        self._measure_shortest = measure_shortest
        self._advance = world.step if autoreset else world.step_within_episode
        self._finals = world.finals if autoreset else world.state.rooms
        self._begin(np.arange(len(world)))

    def __len__(self) -> int:
        return len(self.world)

    @property
    def goals(self) -> NDArray[np.integer]:
        """[N] int, the goal ids pursued now, or -1."""
        return self.ledger.goals

    def reset(self, seed: int | None = None) -> None:
        """Begin an episode in every room: the first one of a seed, or without a seed each room's next."""
        self.world.reset(seed)
        self._begin(np.arange(len(self)))

    def _begin(self, indices: NDArray[np.integer]) -> None:
        self.ledger.put(beginning(self.world.n_actions), indices)
        if self._measure_shortest:
            self.ledger.shortest[indices] = shortest_lengths(self.world.get_state(indices))

    def situation(self, indices: NDArray[np.integer]) -> Situation:
        """What meta-controllers may know of some rooms [M]."""
        rooms, ledger = self.world.state.rooms[indices], self.ledger
        draws = np.empty((len(indices), N_META_ACTIONS))
        turn_draws(rooms, ledger.meta_turns[indices], draws)
        state = State(self.world.state.grids[indices], rooms)
        last = ledger.last_goals[indices], ledger.last_outcomes[indices]
        return Situation(indices, state, *last, draws, self.meta_sight(indices))

    def meta_masks(self, situation: Situation) -> NDArray[np.bool_]:
        """[M, 14] the meta-controller's legal actions: on its turn as `GOAL_MASKS` says, else no goal."""
        masks = np.zeros((len(situation), N_META_ACTIONS), bool)
        is_turn = self.ledger.is_meta_turn[situation.indices]
        if is_turn.any():  # a room stepped by itself mostly waits, and goals take long to find
            masks[:, :N_GOALS] = self._goal_mask.goals(situation) & is_turn[:, None]
        masks[:, NO_GOAL_ACTION] = ~masks[:, :N_GOALS].any(axis=1) | self._goal_mask.may_explore
        return masks

    def choose(self, indices: NDArray[np.integer], actions: ArrayLike, masks: NDArray[np.bool_]) -> None:
        """Take the meta-controller's turn in some rooms [M]; in those whose turn it is not, nothing happens.

        Args:
            indices: the rooms.
            actions: [M] whole numbers: goal ids, or no goal (13 or -1); one that is not legal counts as no goal, and
                the ledger counts it.
            masks: [M, 14] bool, from `meta_masks`.

        Raises:
            InputError: if the actions are not [M] whole numbers.
        """
        given = np.asarray(actions)
        if given.shape != indices.shape or given.dtype.kind not in "iu":
            raise InputError(
                f"the meta-controller's choice must be {len(indices)} goal ids (whole numbers, one for each room whose "
                f"turn it is), not an array of {given.dtype} and shape {given.shape}"
            )
        actions = np.where(given == NO_GOAL, NO_GOAL_ACTION, given)
        in_range = (actions >= 0) & (actions < N_META_ACTIONS)
        is_legal = in_range & masks[np.arange(len(indices)), np.where(in_range, actions, NO_GOAL_ACTION)]
        self.ledger.illegal_goals[indices] += ~is_legal
        goals = np.where(is_legal & (actions < N_GOALS), actions, NO_GOAL)
        is_turn = self.ledger.is_meta_turn[indices]
        self.ledger.begin_options(indices[is_turn], goals[is_turn])

    def ask(self, meta: MetaController) -> None:
        """Let a meta-controller take its turn in every room where it is due.

        Raises:
            InputError: if it does not return one whole number a room.
        """
        indices = np.flatnonzero(self.ledger.is_meta_turn)
        if not len(indices):
            return
        fresh = indices[self.ledger.meta_turns[indices] == 0]
        if len(fresh) and hasattr(meta, "reset"):
            meta.reset(fresh)  # pyright: ignore[reportAttributeAccessIssue] - it is optional
        situation = self.situation(indices)
        masks = self.meta_masks(situation)
        observations = self.meta_observations(situation.sight, situation.last_outcomes, masks)
        self.choose(indices, meta.choose(observations, masks[:, :N_GOALS].copy(), situation), masks)

    def step(self, actions: ArrayLike) -> Step:
        """Take the controller's turn in every room; a room where the meta-controller has not chosen has no goal.

        Args:
            actions: [N] whole numbers; one that does not apply only costs the step.

        Raises:
            InputError: if that is not what the actions are.
        """
        outcomes = self._advance(actions)
        step = self.ledger.record(
            np.asarray(actions, np.int64), outcomes, self.pay, self._subgoal_horizon, self.world.n_actions
        )
        ended = np.flatnonzero(step.over)
        if len(ended) and self._autoreset:
            self._begin(ended)
        elif len(ended):
            self.ledger.is_meta_turn[ended] = False
        return step

    def sight(self, indices: NDArray[np.integer] | slice = slice(None)) -> Sight:
        """What is to be seen now from some rooms; given as a slice, in arrays that the next step overwrites."""
        ledger = self.ledger
        return Sight(
            self.world.outcomes["tiles"][indices],
            self.world.state.rooms[indices],
            ledger.goals[indices],
            ledger.previous_actions[indices],
            ledger.last_outcomes[indices],
        )

    def final_sight(self, step: Step, indices: NDArray[np.integer]) -> Sight:
        """What was to be seen from some rooms [M] right after a step, before a reset or the choice of a new goal.

        Where the step ended an option it is what either agent sees last: the goal is the one whose life just ended.
        """
        over = step.over[indices]
        tiles, rooms = self.world.outcomes["tiles"][indices], self.world.state.rooms[indices]
        tiles[over] = self.world.outcomes["final_tiles"][indices[over]]
        rooms[over] = self._finals[indices[over]]
        return Sight(tiles, rooms, step.goals[indices], step.actions[indices], step.outcomes[indices])

    def meta_sight(self, indices: NDArray[np.integer]) -> Sight:
        """What the meta-controller sees: as the controller, but with the goal it gave last."""
        return replace(self.sight(indices), goals=self.ledger.last_goals[indices])

    def meta_observations(
        self, sight: Sight, outcomes: NDArray[np.integer], masks: NDArray[np.bool_]
    ) -> dict[str, NDArray]:
        """What ``meta_0`` is shown: `controller.observe`, and how its last goal's life ended."""
        return {**observe(sight, masks), "outcome": outcomes.astype(np.int64)}

    def controller_observations(self, sight: Sight) -> dict[str, NDArray]:
        """What ``controller_0`` is shown; all its actions are always legal."""
        return observe(sight, np.ones((len(sight.goals), self.world.n_actions), bool))

    def meta_space(self) -> spaces.Dict:
        """The observation space of ``meta_0``."""
        return spaces.Dict({**observation_spaces(N_META_ACTIONS), "outcome": spaces.Discrete(N_OUTCOMES)})

    def controller_space(self) -> spaces.Dict:
        """The observation space of ``controller_0``."""
        return spaces.Dict(observation_spaces(self.world.n_actions))

    def get_state(self) -> dict[str, np.ndarray]:
        """Everything that changes, as fresh arrays: the rooms' state and the ledger's."""
        state = self.world.get_state()
        return {**self.ledger.get_state(), "grids": state.grids, "rooms": state.rooms}

    def set_state(self, state: Mapping[str, np.ndarray]) -> None:
        """Go back to a state taken earlier with `get_state`.

        Raises:
            InputError: if it is not of as many rooms of the same size, or does not hold what `get_state` gives.
        """
        ledger = dict(state)
        if ledger.keys() != {*self.ledger.get_state(), "grids", "rooms"}:
            raise InputError(f"the state of turns does not hold what get_state gives, but {', '.join(sorted(state))}")
        self.world.set_state(State(ledger.pop("grids"), ledger.pop("rooms")))
        self.ledger.put(ledger)
