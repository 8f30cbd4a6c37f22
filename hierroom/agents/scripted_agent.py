"""Any meta-controller as an agent: a built-in or a custom one, which may learn; and the warm-up of a learned one."""

from __future__ import annotations

from collections import deque
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.meta import (
    META_CONTROLLERS,
    LevelMeta,
    MetaController,
    checked_meta,
    choose_goals,
    random_choice,
    running,
    show_step,
)
from hierroom.support.errors import user_code
from hierroom.support.schema import Flag, Items, Table
from hierroom.turns.records import Step
from hierroom.turns.situation import Situation
from hierroom.turns.turns import Turns


class ScriptedAgent:
    """A `MetaController` as an agent. In training its method ``learn``, if it has one, gets every step."""

    ready = False
    """Always False: it never needs an `update`, because it learns by itself, if at all."""

    def __init__(self, meta: MetaController, *, is_training: bool = False) -> None:
        self.meta: Any = meta
        self._learn = getattr(meta, "learn", None) if is_training else None

    def act(self, observation: Observation) -> NDArray[np.integer]:
        """Return goal ids [M] in the environments of a `Situation`; G or -1 is no goal."""
        assert isinstance(observation, Situation)  # scripted agents are meta-controllers
        return choose_goals(self.meta, observation)

    def record(self, step: Step, turns: Turns) -> None:
        """Show a primitive step to the meta-controller, which in training may learn from it."""
        show_step(self.meta, turns)
        if self._learn is not None:
            with running(self.meta):
                self._learn(step)

    def update(self, observation: Observation, progress: float) -> None:
        """Do nothing: see `ready`."""

    @property
    def statistics(self) -> dict[str, float]:
        """Return the meta-controller's numbers for the metrics."""
        with running(self.meta):
            return {name: float(number) for name, number in getattr(self.meta, "statistics", {}).items()}

    def frozen(self, num_envs: int, *, seed: int) -> ScriptedAgent:
        """Return it for other environments, without learning: the result of its ``for_play``, else a copy."""
        if hasattr(self.meta, "for_play"):
            with running(self.meta):
                meta = self.meta.for_play(num_envs, seed=seed)
            return ScriptedAgent(checked_meta(meta, f"what for_play of {type(self.meta).__name__} returned"))
        needs = "cannot be copied to play elsewhere, and has no method for_play(num_envs, *, seed)"
        with user_code(f"the meta-controller {type(self.meta).__name__}", needs):
            return ScriptedAgent(deepcopy(self.meta))

    def state_dict(self) -> dict[str, Any]:
        """Return the meta-controller's own state dict, empty if it has none."""
        with running(self.meta):
            return self.meta.state_dict() if hasattr(self.meta, "state_dict") else {}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned, if it can."""
        if not hasattr(self.meta, "load_state_dict"):
            return
        with user_code(f"the meta-controller {type(self.meta).__name__}", "cannot load its state"):
            self.meta.load_state_dict(state)


def unsaved_memory(meta: MetaController) -> str | None:
    """Describe the memory of a meta-controller that checkpoints do not save; None if there is none."""
    if isinstance(meta, (LevelMeta, *META_CONTROLLERS.values())):
        return None
    if hasattr(meta, "state_dict") and hasattr(meta, "load_state_dict"):
        return None
    remembers = [f"the method {name}" for name in ("reset", "observe") if hasattr(meta, name)]
    if attributes := ", ".join(getattr(meta, "__dict__", {})):
        remembers.append(f"attributes ({attributes})")
    return " and ".join(remembers) or None


WINDOW = 100
"""Number of last episodes over which success is measured to end the warm-up."""


class WarmUp:
    """Chooses legal goals at random, preferring those seen this episode, until enough episodes reach the target.

    At first the controller reaches no goal, so an option's reward says nothing about its goal. The warm-up ends
    (``has_ended``) when a share ``start_success`` of the last `WINDOW` episodes has reached the target; in a world
    without one, when that share of the last `WINDOW` options has reached its goal.
    """

    def __init__(self, start_success: float, has_target: bool = True) -> None:
        self.has_ended, self._has_target = start_success == 0, has_target
        self._start_success = start_success
        self._successes: deque[bool] = deque(maxlen=WINDOW)

    def choose(self, situation: Situation) -> NDArray[np.integer]:
        """Return goal ids [M]; G or -1 is no goal."""
        likely = situation.masks.copy()
        likely[:, :-1] &= situation.seen
        is_any = likely.any(axis=1, keepdims=True)
        return random_choice(np.where(is_any, likely, situation.masks), situation.uniforms)

    def add(self, step: Step) -> None:
        """Count the episodes, or without a target the options, that a step ended."""
        ends = step.success[step.episode_ended] if self._has_target else step.reached[step.option_ended]
        self._successes.extend(ends.tolist())
        rate = sum(self._successes) / WINDOW
        self.has_ended = len(self._successes) == WINDOW and rate >= self._start_success

    def state_dict(self) -> dict:
        """Return the complete state, as plain types."""
        return {"has_ended": self.has_ended, "successes": list(self._successes)}

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        Table({"has_ended": Flag(), "successes": Items(Flag(), 0, WINDOW)}).check(state, "warm_up")
        self.has_ended, self._successes = state["has_ended"], deque(state["successes"], WINDOW)
