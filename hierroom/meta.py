"""Meta-controllers: who picks the controller's goals. The protocol, those that ship, and how a user's own is found."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.goals import N_COLOURS, N_GOALS, NO_GOAL
from hierroom.plugins import in_one_line, load_plugin
from hierroom.situation import Situation
from hierroom.world import kernels
from hierroom.world.layout import OUTCOME, State
from hierroom.world.oracle import shortest_actions

if TYPE_CHECKING:
    from hierroom.presets import TrainConfig
    from hierroom.step import Step
    from hierroom.turns import Turns

ENTRY_POINT_GROUP = "hierroom.meta_controllers"


@runtime_checkable
class MetaController(Protocol):
    """Chooses goals. Any class with `choose` will do.

    Where there is a method ``reset(indices)`` too, it is called with the places in the batch [M] of the rooms whose
    episode begins, before they are asked about for the first time.
    """

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Choose a goal for each of the M rooms whose turn it is.

        Args:
            observations: the observations of ``meta_0`` in the AEC environment, batched: ``observation``
                [M, 7, 7, 3] uint8, ``goal`` [M, 9] (the last one), ``action_mask`` [M, 14] and the rest.
            legal: [M, 13] bool, the goals that may be chosen; a row may be empty. Whether no goal is legal is the last
                column of the action mask.
            situation: everything else there is to know.

        Returns:
            [M] goal ids 0 to 12, or -1 or 13 for no goal, which asks the controller for something new (see
            `controller.goal_reached`); a goal that is not legal counts as no goal.
        """
        ...


class LearningMeta(MetaController, Protocol):
    """A meta-controller that learns while its controller does.

    `learn`, and the two that save it, are needed, or what it learned would be lost; of the others training uses those
    that it has. Where there is an attribute ``statistics`` too, its numbers by name go into the metrics.
    """

    @classmethod
    def for_training(cls, config: TrainConfig) -> LearningMeta:
        """Make one for a training run (without this, the class is made without arguments)."""
        ...

    def learn(self, step: Step, turns: Turns) -> None:
        """Learn from a primitive step; called after each one, before goals are asked for again.

        Where ``step.option_over`` a goal's life is over: it was paid ``step.meta_rewards``, lasted
        ``step.meta_elapsed`` primitive steps and ended as ``step.outcomes`` says; ``turns.final_sight`` is what was
        seen then.
        """
        ...

    def for_play(self, rooms: int, *, seed: int) -> MetaController:
        """What it has learned as a meta-controller that learns no more, for a number of rooms of their own."""
        ...

    def state_dict(self) -> dict:
        """Everything that decides what happens next, as tensors and plain types: it goes into checkpoints."""
        ...

    def load_state_dict(self, state: dict) -> None:
        """Go back to what `state_dict` gave."""
        ...


class FixedDFS:
    """Goals along a random depth-first path over the goal graph (the meta-controller of the paper's runs).

    At random among the keys within reach, then that key's door, then deeper; the exit as soon as its room is open.
    """

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """The exit, else the door of a key held, else a key in the room opened last that still has one."""
        rooms, n = situation.state.rooms, len(situation)
        opened_at = np.zeros((n, 1 + N_COLOURS), np.int64)  # of every room; the centre is open from step 0
        opened_at[:, 1:] = rooms["opened_at"]
        recency = opened_at[np.arange(n)[:, None], situation.key_rooms]  # [M, 6] of the room the key lies in
        later = rooms["max_steps"].astype(np.int64) + 1
        rank = situation.by_goal(recency, recency + later[:, None], 2 * later)
        return _random_best(rank, legal & situation.reachable, situation.draws[:, :N_GOALS])


class RandomGoals:
    """A legal choice at random."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Each legal goal, and no goal where that is legal, with the same probability."""
        return draw(observations["action_mask"].astype(bool), situation.draws)


class OracleGoals:
    """The next goal on a shortest way to the exit."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """The first goal event of the shortest action sequence, whether or not the mask allows it."""
        return np.array([_first_event(situation.state[m]) for m in range(len(situation))])


class NoGoals:
    """Never a goal: the flat methods."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """No goal in any room."""
        return np.full(len(situation), NO_GOAL)


META_CONTROLLERS: Mapping[str, type | str] = {
    "fixed-dfs": FixedDFS,
    "random": RandomGoals,
    "oracle": OracleGoals,
    "none": NoGoals,
    "learned": "hierroom.learned_meta:LearnedMeta",  # by name, as loading it loads torch
}
"""The meta-controllers that ship, by the name users type."""


def make_meta(spec: str | MetaController, config: TrainConfig | None = None) -> MetaController:
    """The meta-controller a user means.

    Args:
        spec: a name in `META_CONTROLLERS`; the name of an entry point in the group ``hierroom.meta_controllers``;
            ``package.module:Class``, looked for in the current folder too; or a meta-controller itself.
        config: of the training it is for, if any.

    Raises:
        InputError: if there is no such meta-controller, it cannot be made, or it has no method ``choose``.
    """
    if not isinstance(spec, str):
        return _checked(spec, repr(spec))
    make = META_CONTROLLERS.get(spec, spec)
    if isinstance(make, str):
        make = load_plugin(make, "meta-controller", META_CONTROLLERS, ENTRY_POINT_GROUP)
    if hasattr(make, "for_training"):
        if config is None:
            raise InputError(f"the meta-controller {spec!r} is made in training: give the one of a trained agent")
        make = partial(make.for_training, config)
    try:
        meta = make()
    except InputError:
        raise
    except Exception as error:  # whatever a user's own code may raise
        raise InputError(f"the meta-controller {spec!r} cannot be made: {in_one_line(error)}") from error
    return _checked(meta, repr(spec))


def meta_seed(seed: int) -> int:
    """A seed for what a meta-controller draws, so that the controller, who has the run's own, draws other numbers."""
    return int(np.random.SeedSequence([seed, 1]).generate_state(1)[0])


def at_play(meta: MetaController, rooms: int, *, seed: int) -> MetaController:
    """What chooses for a meta-controller where nothing is learned: its ``for_play``, or where it has none itself."""
    return meta.for_play(rooms, seed=meta_seed(seed)) if hasattr(meta, "for_play") else meta  # pyright: ignore[reportAttributeAccessIssue]


def _checked(meta: Any, name: str) -> MetaController:
    if isinstance(meta, type):
        raise InputError(f"a meta-controller is an object, not a class: make one of {meta.__name__}")
    if not callable(getattr(meta, "choose", None)):
        raise InputError(f"a meta-controller has a method choose(observations, legal, situation); {name} has none")
    if hasattr(meta, "learn") and not (hasattr(meta, "state_dict") and hasattr(meta, "load_state_dict")):
        raise InputError(
            f"a meta-controller that learns has the methods state_dict and load_state_dict too, or what it learned "
            f"would be lost; {name} has not both"
        )
    return meta


def draw(choices: NDArray[np.bool_], draws: NDArray[np.float64]) -> NDArray[np.integer]:
    """One of the choices [M, 14] in each room, each with the same probability: [M] goal ids, 13 or -1 for no goal."""
    return _random_best(np.zeros(choices.shape), choices, draws)


def _random_best(rank: NDArray, legal: NDArray[np.bool_], draws: NDArray[np.float64]) -> NDArray[np.integer]:
    """[M] the legal goal of highest whole-numbered rank, ties broken by the draws; no goal where none is legal."""
    best = np.where(legal, rank + draws, NO_GOAL)
    return np.where(legal.any(axis=1), best.argmax(axis=1), NO_GOAL)


def _first_event(state: State) -> int:
    outcomes = np.zeros(1, OUTCOME)
    for action in shortest_actions(state):
        kernels.step_rooms(state.rooms, state.grids, np.array([action], np.int64), outcomes)
        if outcomes["event"][0] >= 0:
            return int(outcomes["event"][0])
    return NO_GOAL
