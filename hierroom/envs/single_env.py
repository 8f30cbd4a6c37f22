"""One environment with its two agents: the common part of the AEC, the parallel and the Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.goals import NO_GOAL
from hierroom.meta import MetaController, take_turn
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.support.schema import Whole
from hierroom.turns.records import AGENTS, CONTROLLER, META, N_OUTCOMES, REPORTED
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig, fresh_seed
from hierroom.worlds.world import whole_numbers

_ONLY, _TRUE = np.zeros(1, np.int64), np.ones(1, bool)
_OUTCOMES = tuple(np.int64(outcome) for outcome in range(N_OUTCOMES))
_AT_RESET = (NO_GOAL, 0, 0, 0, -1, 0.0, 0.0, False, False, False, NO_GOAL, False)
_RESULTS = slice(REPORTED.index("rewards"), REPORTED.index("truncated") + 1)
_HAS_ENDED, _GOAL = REPORTED.index("episode_ended"), REPORTED.index("goals")


class SingleEnv:
    """A batch of one environment with PettingZoo's concepts: two agents with their spaces, and infos as dicts."""

    def __init__(self, config: EnvConfig, render_mode: str | None):
        self.turns = Turns(config, autoreset=False, measure_shortest=True)
        turns, self._has_window = self.turns, render_mode == "human"
        self.observation_spaces: dict[str, spaces.Space] = {agent: turns.observation_space(agent) for agent in AGENTS}
        self.action_spaces: dict[str, spaces.Space] = {agent: turns.action_space(agent) for agent in AGENTS}
        self._screen = self.turns.world.screen(render_mode)
        self.has_begun = False
        self._choice = np.zeros(1, np.int64)
        self._all_legal = np.ones(self.turns.world.n_actions, np.int8)
        self._is_discrete = self.turns.world.n_actions > 0
        self._waits = NO_GOAL, self.turns.world.goals.no_goal_action
        self._last: Any = _AT_RESET  # the results of the last step, as Python numbers

    def reset(self, seed: int | None, options: dict | None) -> dict[str, dict[str, Any]]:
        """Begin an episode, the first one of a seed or without a seed the next one, and return its first infos."""
        if seed is not None:
            Whole(0, 2**63 - 1).check(seed, "a seed")  # a batch of one would also accept a list of one seed
        checked_options(options)
        self.turns.reset(fresh_seed() if seed is None and not self.has_begun else seed)
        self.has_begun = True
        self._last = *_AT_RESET[:4], self.turns.ledger.shortest.item(), *_AT_RESET[5:]
        self._show()
        return self.infos()

    @property
    def is_meta_turn(self) -> bool:
        """Return whether the meta-controller acts next."""
        return self.turns.ledger.is_meta_turn.item()

    @property
    def goal(self) -> int:
        """The id of the pursued goal, or -1; after the end of an episode, the last goal of that episode."""
        return self._last[_GOAL] if self._last[_HAS_ENDED] else self.turns.ledger.goals.item()

    def observation(self, agent: str) -> Observation:
        """Return an agent's observation as a batch of one; after the end of an episode, the controller's last one."""
        step = self.turns.last_step
        if agent == CONTROLLER and step is not None and step.episode_ended[0]:
            return self.turns.final_observation(CONTROLLER, step, _ONLY)
        return self.turns.observe(agent, _ONLY)

    def observe(self, agent: str) -> dict[str, NDArray]:
        """Return an agent's observation in the form of `Observation.as_dict`, in new arrays."""
        if agent not in AGENTS:
            raise InputError(f"the agents are {META} and {CONTROLLER}; there is no {agent!r}")
        turns, ledger, is_meta = self.turns, self.turns.ledger, agent == META
        observation = turns.world.observe_one(ledger.last_goals.item() if is_meta else self.goal)
        if is_meta:
            observation["action_mask"] = turns.meta_masks()[0].view(np.int8)
            observation["outcome"] = _OUTCOMES[ledger.last_outcomes.item()]
        elif self._is_discrete:
            masks = turns.world.action_masks
            observation["action_mask"] = self._all_legal.copy() if masks is None else masks[0].astype(np.int8)
        return observation

    def choose(self, action: int) -> None:
        """Take the meta-controller's action; an illegal one counts as no goal."""
        is_turn = self.is_meta_turn
        self._choice[0] = as_action(action)
        if is_turn:
            self.turns.choose_everywhere(self._choice)
            self._show()
        elif self._choice[0] not in self._waits:
            self.turns.ledger.count_illegal_goals(_ONLY, _TRUE)

    def ask(self, meta: MetaController) -> None:
        """Let a meta-controller choose, if it is its turn."""
        if self.is_meta_turn:
            take_turn(meta, self.turns)
            self._show()

    def as_action(self, action: Any) -> Any:
        """Return an action of the controller in the form of its kind, or refuse it."""
        return as_action(action) if self._is_discrete else self.turns.action_kind.read([action], 1)[0]

    def act_alone(self, action: Any) -> tuple[float, float, bool, bool]:
        """Take the controller's action; return its reward, the extrinsic reward, and (terminated, truncated) flags.

        This is faster than `act`, because it makes no dicts by agent. The Gymnasium environment uses it.
        """
        turns = self.turns
        turns.actions[0] = as_action(action) if self._is_discrete else self.as_action(action)
        self._last = turns.step().reported.item()
        if self._has_window:
            self._show()
        return self._last[_RESULTS]

    def act(self, action: Any) -> tuple[dict[str, float], dict[str, bool], dict[str, bool]]:
        """Take the controller's action and return (rewards, terminations, truncations), each as a dict by agent."""
        reward, extrinsic, terminated, truncated = self.act_alone(action)
        return (
            {META: extrinsic, CONTROLLER: reward},
            {META: terminated, CONTROLLER: terminated},
            {META: truncated, CONTROLLER: truncated},
        )

    def infos(self) -> dict[str, dict[str, Any]]:
        """Return the infos of both agents, in new dicts that always have the same keys.

        ``goal_event`` is the goal id that the last primitive step achieved, or -1. ``elapsed`` counts primitive steps
        since the agent's last turn. ``illegal_actions`` counts the agent's illegal actions in this episode. ``success``
        says whether the exit was reached. ``length`` counts primitive steps of the episode so far, and
        ``shortest_length`` those of a shortest solution.
        """
        return {META: self.info(META), CONTROLLER: self.info(CONTROLLER)}

    def info(self, agent: str) -> dict[str, Any]:
        """Return the info of one agent: see `infos`."""
        event, elapsed, meta_elapsed, length, shortest, _, _, _, _, _, _, success = self._last
        ledger, is_meta = self.turns.ledger, agent == META
        return {
            "goal_event": event,
            "elapsed": meta_elapsed if is_meta else elapsed,
            "illegal_actions": (ledger.illegal_goals if is_meta else ledger.illegal_actions).item(),
            "success": success,
            "length": length,
            "shortest_length": shortest,
        }

    def render(self) -> str | NDArray[np.uint8] | None:
        """Return the level as text or as a picture [H, W, 3], or show it in a window, with the current subgoal."""
        if not self.has_begun:
            raise InputError("reset the environment before it is rendered")
        return self._screen.render(0, self.turns.ledger.goals.item())

    def close(self) -> None:
        """Close the window, if one is open, and the world."""
        self._screen.close()
        self.turns.world.close()

    def _show(self) -> None:
        self._screen.show(0, self.turns.ledger.goals.item())


def checked_options(options: Any, *known: str) -> dict[str, Any]:
    """Return the options of a reset as a dict, empty for None; warn once about unknown ones."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise InputError(f"options of a reset are a dict or None, not {shown(options)}")
    if ignored := [shown(name) for name in options if name not in known]:
        made = "pass graph and the like when making the environment"
        taken = f"the options {' and '.join(known)}" if known else "no options"
        warn_once(f"a reset takes {taken}; it ignores {', '.join(ignored)} ({made})")
    return dict(options)


def as_action(action: Any) -> int:
    """Return an action as a 64-bit number; a number that does not fit becomes -2, which is illegal."""
    if type(action) is int or (isinstance(action, (int, np.integer)) and not isinstance(action, bool)):
        return int(action) if -(2**63) <= action < 2**63 else -2  # the fast path for the usual types
    try:
        return int(whole_numbers([action], 1)[0])
    except InputError:
        raise InputError(f"an action must be a whole number, not {shown(action)}") from None
