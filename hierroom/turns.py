"""The turn clock and the reward ledger of the two agents: the only place that knows that two clocks exist.

``meta_0`` acts at reset and whenever its goal's life is over: the goal is reached, its horizon has run out, or, under
'no goal', any goal event has happened. ``controller_0`` acts at every other moment, one primitive step a turn. The
AEC, parallel and Gymnasium environments and the trainer are views of this class, so they cannot disagree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.controller import PAYS, Sight, goal_reached, observation_spaces, observe
from hierroom.errors import InputError
from hierroom.goals import N_GOALS, NO_GOAL
from hierroom.meta import GOAL_MASKS, NO_OUTCOME, OTHER, REACHED, TIMED_OUT, MetaController, Situation
from hierroom.world.batch import Batch
from hierroom.world.kernels import turn_draws
from hierroom.world.layout import State
from hierroom.world.oracle import shortest_lengths

NO_GOAL_ACTION = N_GOALS
"""The meta-controller's 14th action: no goal. While it is not its turn, this is the one it may take: wait."""
N_META_ACTIONS = N_GOALS + 1
_ARRAYS = (
    "is_meta_turn",
    "goals",
    "last_goals",
    "last_outcomes",
    "meta_turns",
    "option_steps",
    "option_rewards",
    "previous_actions",
)


@dataclass(frozen=True)
class Step:
    """What one primitive step did in N rooms.

    Args:
        actions: [N] int, the controller's actions.
        goals: [N] int, the goal ids pursued.
        events: [N] int, the goal ids achieved, or -1.
        rewards: [N] float64, the controller's pay.
        extrinsic: [N] float64, the environment's own reward.
        reached: [N] bool, the goal was reached.
        timed_out: [N] bool, the goal's horizon ran out before it was reached or the episode ended.
        option_over: [N] bool, the goal's life is over for whatever reason: the meta-controller's turn ends here.
        outcomes: [N] int, where the option is over how it ended: ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        meta_rewards: [N] float64, where the option is over the extrinsic reward summed over its life, else 0.
        meta_elapsed: [N] int, primitive steps since the meta-controller's last turn, this one included.
        terminated: [N] bool, the exit was reached.
        truncated: [N] bool, the time limit was reached.
        lengths: [N] int, steps of the episode so far.
        shortest: [N] int, where the episode is over its shortest possible length, or -1 where that is not measured.
    """

    actions: NDArray[np.integer]
    goals: NDArray[np.integer]
    events: NDArray[np.integer]
    rewards: NDArray[np.float64]
    extrinsic: NDArray[np.float64]
    reached: NDArray[np.bool_]
    timed_out: NDArray[np.bool_]
    option_over: NDArray[np.bool_]
    outcomes: NDArray[np.integer]
    meta_rewards: NDArray[np.float64]
    meta_elapsed: NDArray[np.integer]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    lengths: NDArray[np.integer]
    shortest: NDArray[np.integer]

    @property
    def over(self) -> NDArray[np.bool_]:
        """[N] bool, the episode ended."""
        return self.terminated | self.truncated


class Turns:
    """Two agents taking turns in a batch of N rooms.

    Args:
        world: the rooms; the turns own their stepping from here on.
        pay: how the controller is paid, a name in `PAYS`.
        subgoal_horizon: steps after which a goal's life ends unreached, or None for never.
        goal_mask: which goals are legal, a name in `GOAL_MASKS`.
        autoreset: whether a room whose episode ends begins its next one in the same step.
        measure_shortest: whether each episode's shortest length is reported (about a millisecond an episode).

    Raises:
        InputError: if a name is unknown or the horizon is not at least 1.
    """

    def __init__(
        self,
        world: Batch,
        *,
        pay: str = "extrinsic",
        subgoal_horizon: int | None = None,
        goal_mask: str = "reachable",
        autoreset: bool = True,
        measure_shortest: bool = False,
    ):
        for what, value, known in (("pay", pay, PAYS), ("goal_mask", goal_mask, GOAL_MASKS)):
            if value not in known:
                raise InputError(f"{what} is one of {', '.join(known)}, not {value!r}")
        if subgoal_horizon is not None and (not isinstance(subgoal_horizon, int) or subgoal_horizon < 1):
            raise InputError(f"subgoal_horizon must be a whole number of at least 1 or None, not {subgoal_horizon!r}")
        self.world = world
        self.pay = PAYS[pay]
        self.subgoal_horizon = subgoal_horizon or np.iinfo(np.int64).max
        self.goal_mask = GOAL_MASKS[goal_mask]
        self._autoreset = autoreset
        self._advance = world.step if autoreset else world.step_within_episode
        self._finals = world.finals if autoreset else world.state.rooms
        n = len(world)
        self.is_meta_turn = np.ones(n, bool)
        self.goals = np.full(n, NO_GOAL)
        self.last_goals = np.full(n, NO_GOAL)
        self.last_outcomes = np.full(n, NO_OUTCOME)
        self.meta_turns = np.zeros(n, np.int64)
        self.option_steps = np.zeros(n, np.int64)
        self.option_rewards = np.zeros(n)
        self.previous_actions = np.full(n, world.n_actions)
        self._starts = world.get_state() if measure_shortest else None

    def __len__(self) -> int:
        return len(self.world)

    def reset(self, seed: int | None = None) -> None:
        """Begin an episode in every room: the first one of a seed, or without a seed each room's next."""
        self.world.reset(seed)
        self._begin(np.arange(len(self)))

    def situation(self, indices: NDArray[np.integer]) -> Situation:
        """What meta-controllers may know of some rooms [M]."""
        state = self.world.get_state(indices)
        draws = np.empty((len(indices), N_GOALS))
        turn_draws(state.rooms, self.meta_turns[indices], draws)
        return Situation(indices, state, self.last_goals[indices], self.last_outcomes[indices], draws)

    def meta_masks(self, situation: Situation) -> NDArray[np.bool_]:
        """[M, 14] the meta-controller's legal actions: goals on its turn, else (or where none is left) no goal."""
        legal = self.goal_mask(situation) & self.is_meta_turn[situation.indices, None]
        return np.concatenate([legal, ~legal.any(axis=1, keepdims=True)], axis=1)

    def choose(self, indices: NDArray[np.integer], actions: ArrayLike, masks: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Take the meta-controller's turn in some rooms [M].

        Args:
            indices: the rooms; in those whose turn it is not, nothing happens.
            actions: [M] int, goal ids, or no goal (13 or -1); one that is not legal counts as no goal.
            masks: [M, 14] bool, from `meta_masks`.

        Returns:
            [M] bool, where the action was legal.
        """
        actions = np.asarray(actions, np.int64)
        actions = np.where(actions == NO_GOAL, NO_GOAL_ACTION, actions)
        known = (actions >= 0) & (actions < N_META_ACTIONS)
        is_legal = known & masks[np.arange(len(indices)), np.where(known, actions, NO_GOAL_ACTION)]
        is_turn = self.is_meta_turn[indices]
        goals = np.where(is_legal & (actions < N_GOALS), actions, NO_GOAL)
        chosen = indices[is_turn]
        self.goals[chosen] = goals[is_turn]
        self.meta_turns[chosen] += 1
        self.is_meta_turn[chosen] = False
        return is_legal

    def ask(self, meta: MetaController) -> None:
        """Let a meta-controller take its turn in every room where it is due.

        Raises:
            InputError: if it does not return one whole number a room.
        """
        indices = np.flatnonzero(self.is_meta_turn)
        if not len(indices):
            return
        beginning = indices[self.meta_turns[indices] == 0]
        if len(beginning) and hasattr(meta, "reset"):
            meta.reset(beginning)  # pyright: ignore[reportAttributeAccessIssue]
        situation = self.situation(indices)
        masks = self.meta_masks(situation)
        observations = self.meta_observations(self.meta_sight(indices), situation.last_outcomes, masks)
        goals = np.asarray(meta.choose(observations, masks[:, :-1], situation))
        if goals.shape != indices.shape or goals.dtype.kind not in "iu":
            raise InputError(
                f"choose must return {len(indices)} goal ids (whole numbers, one for each room whose turn it is); "
                f"{type(meta).__name__} returned shape {goals.shape} of {goals.dtype}"
            )
        self.choose(indices, goals, masks)

    def step(self, actions: ArrayLike) -> Step:
        """Take the controller's turn in every room; a room where the meta-controller has not chosen has no goal.

        Args:
            actions: [N] int; one that does not apply only costs the step.
        """
        actions = np.asarray(actions, np.int64)
        self.is_meta_turn[:] = False
        outcomes = self._advance(actions)
        goals, events = self.goals.copy(), outcomes["event"].astype(np.int64)
        terminated, truncated = outcomes["terminated"].copy(), outcomes["truncated"].copy()
        over = terminated | truncated
        self.option_steps += 1
        self.option_rewards += outcomes["reward"]
        reached = goal_reached(events, goals)
        timed_out = (self.option_steps >= self.subgoal_horizon) & ~reached & ~over
        distracted = (goals == NO_GOAL) & (events >= 0)
        option_over = reached | timed_out | distracted | over
        step = Step(
            actions=actions,
            goals=goals,
            events=events,
            rewards=self.pay.rewards(outcomes, goals),
            extrinsic=outcomes["reward"].copy(),
            reached=reached,
            timed_out=timed_out,
            option_over=option_over,
            outcomes=np.select([reached, timed_out], [REACHED, TIMED_OUT], OTHER),
            meta_rewards=np.where(option_over, self.option_rewards, 0.0),
            meta_elapsed=self.option_steps.copy(),
            terminated=terminated,
            truncated=truncated,
            lengths=outcomes["length"].astype(np.int64),
            shortest=self._shortest(over),
        )
        self.previous_actions[:] = actions
        self._end_options(step)
        if over.any():
            self._end_episodes(np.flatnonzero(over))
        return step

    def sight(self, indices: NDArray[np.integer] | slice = slice(None)) -> Sight:
        """What is to be seen now from some rooms."""
        return Sight(
            self.world.outcomes["tiles"][indices],
            self.world.state.rooms[indices],
            self.goals[indices],
            self.previous_actions[indices],
        )

    def final_sight(self, step: Step, indices: NDArray[np.integer]) -> Sight:
        """What was to be seen from some rooms [M] right after a step, before a reset or the choice of a new goal."""
        over = step.over[indices]
        tiles, rooms = self.world.outcomes["tiles"][indices], self.world.state.rooms[indices]
        tiles[over] = self.world.outcomes["final_tiles"][indices[over]]
        rooms[over] = self._finals[indices[over]]
        return Sight(tiles, rooms, step.goals[indices], step.actions[indices])

    def meta_sight(self, indices: NDArray[np.integer]) -> Sight:
        """What the meta-controller sees: as the controller, but with the goal it gave last."""
        return replace(self.sight(indices), goals=self.last_goals[indices])

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
        return spaces.Dict({**observation_spaces(N_META_ACTIONS), "outcome": spaces.Discrete(4)})

    def controller_space(self) -> spaces.Dict:
        """The observation space of ``controller_0``."""
        return spaces.Dict(observation_spaces(self.world.n_actions))

    def get_state(self) -> dict[str, np.ndarray]:
        """Everything that changes, as fresh arrays: the rooms' state and the turns' own."""
        own = {name: getattr(self, name).copy() for name in _ARRAYS}
        state = self.world.get_state()
        return {**own, "grids": state.grids, "rooms": state.rooms}

    def set_state(self, state: dict[str, np.ndarray]) -> None:
        """Go back to a state taken earlier with `get_state`."""
        self.world.set_state(State(state["grids"], state["rooms"]))
        for name in _ARRAYS:
            getattr(self, name)[:] = state[name]

    def _shortest(self, over: NDArray[np.bool_]) -> NDArray[np.integer]:
        lengths = np.full(len(self), -1)
        if self._starts is not None and over.any():
            lengths[over] = shortest_lengths(self._starts[over])
        return lengths

    def _end_options(self, step: Step) -> None:
        ended = step.option_over
        self.last_goals[ended], self.last_outcomes[ended] = step.goals[ended], step.outcomes[ended]
        self.is_meta_turn[ended], self.goals[ended] = True, NO_GOAL
        self.option_steps[ended], self.option_rewards[ended] = 0, 0.0

    def _end_episodes(self, indices: NDArray[np.integer]) -> None:
        if self._autoreset:
            self._begin(indices)
        else:
            self.is_meta_turn[indices] = False

    def _begin(self, indices: NDArray[np.integer]) -> None:
        self.is_meta_turn[indices], self.meta_turns[indices] = True, 0
        self.goals[indices], self.last_goals[indices] = NO_GOAL, NO_GOAL
        self.last_outcomes[indices], self.previous_actions[indices] = NO_OUTCOME, self.world.n_actions
        self.option_steps[indices], self.option_rewards[indices] = 0, 0.0
        if self._starts is not None:
            now = self.world.get_state(indices)
            self._starts.grids[indices], self._starts.rooms[indices] = now.grids, now.rooms
