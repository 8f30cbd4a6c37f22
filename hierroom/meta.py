"""Meta-controllers, which pick the controller's goals: the protocol, the built-in ones, and loading custom ones."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import NO_GOAL
from hierroom.support.arrays import read_only
from hierroom.support.errors import InputError, shown, text_of, user_code
from hierroom.support.plugins import load_plugin
from hierroom.turns.records import META
from hierroom.turns.situation import Situation
from hierroom.turns.turns import Turns

LEARNED = "learned"
"""The name of the meta-controller that PPO trains together with the controller (the paper's Algorithm 1)."""
GIVE_TRAINED = "give that of a trained run, in Python hierroom.load(RUN).meta_controller()"


@runtime_checkable
class MetaController(Protocol):
    """Chooses goals. Any class with a method `choose` is a meta-controller; the other methods are optional.

    ``reset(envs)`` is called before the first choice of an episode, with the indices [M] of the environments.
    ``observe(step, turns)`` is called after every primitive step of all N environments. New episodes may have begun by
    then; ``turns.final_observation`` gives the last observation of the old ones. ``state_dict()`` and
    ``load_state_dict(state)`` save and restore its memory in checkpoints, as tensors and plain types.

    One that learns has them and ``learn(step)``, called in training after each primitive step; ``step.option_ended``
    says which options the step ended. Numbers in its dict ``statistics`` go into the metrics. The class method
    ``for_training(num_envs)`` returns a new one for training, ``for_play(num_envs, *, seed)`` a copy that no longer
    learns, for other environments.

    Examples:
        >>> class First:
        ...     def choose(self, observations, legal, situation): return legal.argmax(axis=1)
        >>> env = gymnasium.make("hierroom/EscapeRoom-a-v0", meta=First())
        >>> env.reset(seed=0)[0]["goal"][:3].tolist()  # a key, not a door or the exit
        [1.0, 0.0, 0.0]
        >>> class Counter(hierroom.meta.FixedDFS):
        ...     n_options = 0
        ...     def learn(self, step): self.n_options += int(step.option_ended.sum())
        ...     def state_dict(self): return {"n_options": self.n_options}
        ...     def load_state_dict(self, state): self.n_options = state["n_options"]
        >>> hierroom.meta.make_meta(Counter(), num_envs=8).state_dict()
        {'n_options': 0}
    """

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Choose a goal for each of M environments; the shapes below are those of EscapeRooms.

        Args:
            observations: the observations of ``meta_0`` in the AEC environment, batched: ``observation``
                [M, 7, 7, 3] uint8, ``goal`` [M, 9] (the last one), ``action_mask`` [M, 14] and the rest.
            legal: [M, 13] bool, the legal goals; a row may be all False. The mask's last column is for 'no goal'.
            situation: all other facts, read-only; ``situation.level(m)`` is the m-th environment as objects.

        Returns:
            Goal ids [M] int, 0 to 12. -1, 13 and illegal goals mean 'no goal' (see `ledger.Ledger`).
        """
        ...


class FixedDFS:
    """Goals along a random depth-first path over the goal graph (the meta-controller of the paper's runs).

    It picks a random reachable key, then that key's door, then goes deeper; the exit as soon as its room is open.
    """

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Return the exit if reachable, else the door of a held key, else a key in the last opened room with keys."""
        return _random_best(situation.depth_first_ranks, legal & situation.reachable, situation.uniforms[:, :-1])


class RandomGoals:
    """Legal goals, and 'no goal' where it is legal, drawn uniformly at random."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Return a random legal choice for each environment."""
        return random_choice(situation.masks, situation.uniforms)


class OracleGoals:
    """The next goal on a shortest path to the target, in worlds that can compute one."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Return the first goal event of the shortest action sequence, whether or not the mask allows it."""
        goals = getattr(situation.view, "oracle_goals", None)
        if goals is None:
            raise InputError("the oracle needs a world that knows its shortest ways; a task of your own has no oracle")
        return goals


class NoGoals:
    """No goal at any time, for the flat methods."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Return no goal, -1, for each environment."""
        return np.full(len(situation), NO_GOAL)


class LevelMeta:
    """A plain function as a meta-controller. It maps a `Level` to one of its goals, a goal id, or None (no goal)."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self.function = function

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Return the function's goal for each environment; where no goal is legal, do not call it."""
        n_goals, envs = len(situation.goal_set), range(len(situation))
        return np.array([self._goal(situation.level(m), n_goals) if legal[m].any() else NO_GOAL for m in envs])

    def _goal(self, level: Any, n_goals: int) -> int:
        if (goal := self.function(level)) is None:
            return NO_GOAL
        number = getattr(goal, "id", goal)
        if isinstance(number, (int, np.integer)) and not isinstance(number, bool) and NO_GOAL <= number <= n_goals:
            return int(number)
        if inspect.iscoroutine(goal):
            goal.close()
        name = getattr(self.function, "__name__", "a meta-controller's function")
        given = text_of(goal)
        raise InputError(f"{name} must return a goal of the level, a goal id (0 to {n_goals - 1}) or None, not {given}")


META_CONTROLLERS: Mapping[str, type]
META_CONTROLLERS = {"fixed-dfs": FixedDFS, "random": RandomGoals, "oracle": OracleGoals, "none": NoGoals}
"""Meta-controllers that do not learn, by the names that users type; `LEARNED` is one more name."""

MetaSpec = str | MetaController | Callable[[Any], Any]
"""Forms in which `make_meta` accepts a meta-controller."""


def make_meta(spec: MetaSpec, num_envs: int | None = None) -> MetaController:
    """Return the meta-controller that a user specified.

    Args:
        spec: a name in `META_CONTROLLERS`; ``package.module:Class`` or ``package.module:function``, also in the current
            folder; a meta-controller; or a function from a `Level` to one of its goals.
        num_envs: number of training environments; None outside training.

    Examples:
        >>> [type(hierroom.meta.make_meta(name)).__name__ for name in ("fixed-dfs", "random", "oracle", "none")]
        ['FixedDFS', 'RandomGoals', 'OracleGoals', 'NoGoals']
        >>> meta = hierroom.meta.make_meta(lambda level: min(level.legal_goals, key=lambda goal: goal.distance))
    """
    if not isinstance(spec, str):
        with user_code(f"the meta-controller {shown(spec)}"):  # reading an attribute may run user code
            return checked_meta(LevelMeta(spec) if _is_function(spec) else spec, shown(spec))
    if spec == LEARNED:
        raise InputError(f"the learned meta-controller is made in training: {GIVE_TRAINED}")
    known = META_CONTROLLERS if num_envs is None else (*META_CONTROLLERS, LEARNED)
    make = META_CONTROLLERS.get(spec) or load_plugin(spec, "meta-controller", known, "Class or :function")
    if _is_function(make):
        return LevelMeta(make)
    with user_code(f"the meta-controller {spec!r}", "cannot be made"):
        if not isinstance(make, type) and hasattr(make, "choose"):
            raise InputError(f"{spec!r} is an object with a method choose; name its class, to be made by a run")
        if not hasattr(make, "for_training"):
            meta = make()
        elif num_envs is None:
            raise InputError(f"the meta-controller {spec!r} is made in training: {GIVE_TRAINED}")
        else:
            meta = make.for_training(num_envs)
            if meta is None:
                raise InputError(f"for_training of the meta-controller {spec!r} must return one, not None")
    with user_code(f"the meta-controller {spec!r}"):
        return checked_meta(meta, repr(spec))


def choose_goals(meta: MetaController, situation: Situation) -> NDArray[np.integer]:
    """Return a meta-controller's goals [M]; where an episode begins, call its ``reset`` first."""
    beginning = situation.envs[situation.meta_turns == 0]
    observations, legal = situation.as_dict(), situation.legal.copy()
    shown = situation
    if type(meta) not in META_CONTROLLERS.values():
        arrays = {name: read_only(value) for name, value in vars(situation).items() if isinstance(value, np.ndarray)}
        shown = replace(situation, **arrays)
    with running(meta):
        if len(beginning) and hasattr(meta, "reset"):
            meta.reset(beginning)  # pyright: ignore[reportAttributeAccessIssue] - it is optional
        return meta.choose(observations, legal, shown) if legal.shape[1] else np.full(len(legal), NO_GOAL)


def take_turn(meta: MetaController, turns: Turns) -> None:
    """Let a meta-controller take its turn wherever it is due."""
    if not turns.ledger.is_any_turn():
        return
    if type(meta) is NoGoals:
        turns.choose_everywhere(np.full(len(turns), NO_GOAL))
    else:
        situation = turns.situation(turns.due(META))
        turns.choose(situation, choose_goals(meta, situation))


def show_step(meta: MetaController, turns: Turns) -> None:
    """Pass the last step to a meta-controller that has ``observe``."""
    if hasattr(meta, "observe"):
        step, before = turns.last_step, _moment(turns)
        assert step is not None
        with running(meta):
            meta.observe(step, turns)  # pyright: ignore[reportAttributeAccessIssue] - it is optional
            if turns.last_step is not step or _moment(turns) != before:
                raise RuntimeError("it took a step or began episodes in the environments that it was to observe")


def _moment(turns: Turns) -> tuple[bytes, bytes]:
    return turns.ledger.records.tobytes(), turns.world.clocks().tobytes()


def running(meta: MetaController) -> AbstractContextManager[None]:
    """Return a context for calling a meta-controller: errors of a custom one become one-line `InputError`s."""
    if type(meta) in META_CONTROLLERS.values():
        return nullcontext()
    named = meta.function if isinstance(meta, LevelMeta) else type(meta)
    return user_code(f"the meta-controller {getattr(named, '__name__', shown(named))}")


def random_choice(choices: NDArray[np.bool_], uniforms: NDArray[np.float64]) -> NDArray[np.integer]:
    """Draw uniformly from each environment's choices [M, G + 1]; return goal ids [M], with G or -1 for no goal."""
    return _random_best(np.zeros(choices.shape), choices, uniforms)


def checked_meta(meta: Any, name: str) -> Any:
    """Return the meta-controller, or refuse an object that cannot be one; ``name`` is for error messages."""
    if isinstance(meta, type):
        raise InputError(f"a meta-controller is an object, not a class: make one of {meta.__name__}")
    if isinstance(meta, (np.ndarray, np.generic)) or not callable(getattr(meta, "choose", None)):  # not NumPy's
        raise InputError(f"a meta-controller has a method choose(observations, legal, situation); {name} has none")
    if hasattr(meta, "for_training") and not hasattr(meta, "for_play"):
        raise InputError(f"a meta-controller with for_training needs for_play(num_envs, *, seed); {name} has none")
    for method in ("reset", "observe", "learn", "state_dict", "load_state_dict", "for_play"):
        if not callable(getattr(meta, method, print)):
            raise InputError(f"{method} of a meta-controller is a method; that of {name} is {getattr(meta, method)!r}")
    rule, statistics = "statistics of a meta-controller are numbers by name", getattr(meta, "statistics", {})
    if not isinstance(statistics, Mapping):
        raise InputError(f"{rule}; those of {name} are {shown(statistics)}")
    for entry, value in statistics.items():
        if not (isinstance(entry, str) and entry != "illegal_goals" and _is_number(value)):
            raise InputError(f"{rule}; {shown(entry)} of {name} is {shown(value)}")
    if hasattr(meta, "learn") and not (hasattr(meta, "state_dict") and hasattr(meta, "load_state_dict")):
        raise InputError(f"a meta-controller that learns needs state_dict and load_state_dict; {name} lacks one")
    return meta


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return not isinstance(value, str)


def _is_function(thing: Any) -> TypeGuard[Callable[[Any], Any]]:
    return callable(thing) and not isinstance(thing, type) and not hasattr(thing, "choose")


def _random_best(rank: NDArray, legal: NDArray[np.bool_], uniforms: NDArray[np.float64]) -> NDArray[np.integer]:
    best = np.where(legal, rank + uniforms, NO_GOAL)
    return np.where(legal.any(axis=1), best.argmax(axis=1), NO_GOAL)
