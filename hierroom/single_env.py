"""One environment with its two agents: what the AEC, the parallel and the Gymnasium environment share."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.env_config import EnvConfig, fresh_seed
from hierroom.errors import InputError
from hierroom.goals import NO_GOAL
from hierroom.meta import MetaController, show_step
from hierroom.options import AGENTS, CONTROLLER, META
from hierroom.turns import Turns
from hierroom.world.render import Screen

_ONLY = np.zeros(1, np.int64)


class SingleEnv:
    """A batch of one, in the terms of PettingZoo.

    Args:
        config: what the environment is made of.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.

    Attributes:
        turns: the turns of the two agents.
        observation_spaces: the space of each agent's observations.
        action_spaces: the space of each agent's actions.
        complexity: the `ComplexityReport` of its goal graph.
    """

    def __init__(self, config: EnvConfig, render_mode: str | None):
        self.turns = Turns(config, autoreset=False, measure_shortest=True)
        self.complexity = self.turns.complexity
        self.observation_spaces: dict[str, spaces.Space] = {
            agent: self.turns.observation_space(agent) for agent in AGENTS
        }
        self.action_spaces: dict[str, spaces.Space] = {agent: self.turns.action_space(agent) for agent in AGENTS}
        self._screen = Screen(render_mode)
        self._is_seeded = False

    def reset(self, seed: int | None, options: dict | None) -> dict[str, dict[str, Any]]:
        """Begin an episode: the first one of a seed, or without a seed the next one; returns its first infos."""
        self.turns.reset(fresh_seed() if seed is None and not self._is_seeded else seed)
        self._is_seeded = True
        self._show()
        infos = self.infos()
        if (options or {}).get("complexity"):
            for info in infos.values():
                info["complexity"] = self.complexity.to_dict()
        return infos

    @property
    def is_meta_turn(self) -> bool:
        """Whether the meta-controller is to act next."""
        return bool(self.turns.ledger.is_meta_turn[0])

    def observation(self, agent: str) -> Observation:
        """What an agent observes now, as a batch of one; the controller after the episode's end what it saw last."""
        step = self.turns.last_step
        if agent == CONTROLLER and step is not None and step.episode_ended[0]:
            return self.turns.final_observation(CONTROLLER, step, _ONLY)
        return self.turns.observe(agent, _ONLY)

    def observe(self, agent: str) -> dict[str, NDArray]:
        """What an agent observes now, in fresh arrays."""
        return {name: values[0] for name, values in self.observation(agent).as_dict().items()}

    def choose(self, action: int) -> None:
        """Take the meta-controller's action; one that is not legal counts as no goal."""
        is_turn = self.is_meta_turn
        self.turns.choose(self.turns.situation(_ONLY), [action])
        if is_turn:
            self._show()

    def ask(self, meta: MetaController) -> None:
        """Let a meta-controller choose, if it is its turn."""
        if self.is_meta_turn:
            self.turns.ask(meta)
            self._show()

    def show_step(self, meta: MetaController) -> None:
        """Let a meta-controller that watches see the last step."""
        if self.turns.last_step is not None:
            show_step(meta, self.turns.last_step, self.turns)

    def act(self, action: int) -> tuple[dict[str, float], dict[str, bool], dict[str, bool]]:
        """Take the controller's action.

        Returns:
            (rewards, terminations, truncations), each a dict by agent.
        """
        step = self.turns.step([action])
        self._show()
        rewards = {META: float(step.extrinsic[0]), CONTROLLER: float(step.rewards[0])}
        return (
            rewards,
            dict.fromkeys(AGENTS, bool(step.terminated[0])),
            dict.fromkeys(AGENTS, bool(step.truncated[0])),
        )

    def infos(self) -> dict[str, dict[str, Any]]:
        """What there is to say to each agent besides, in fresh dicts.

        Returns:
            ``goal_event``, the goal id that the last primitive step achieved, or -1; ``elapsed``, primitive steps
            since the agent's last turn; ``illegal_actions``, how many it took this episode; at the episode's end
            ``success``, ``length`` and ``shortest_length``.
        """
        step, ledger = self.turns.last_step, self.turns.ledger
        event, elapsed, ending = NO_GOAL, {META: 0, CONTROLLER: 0}, {}
        if step is not None:
            event, elapsed = int(step.events[0]), {META: int(step.meta_elapsed[0]), CONTROLLER: 1}
            if step.episode_ended[0]:
                ending["success"] = bool(step.terminated[0])
                ending["length"], ending["shortest_length"] = int(step.lengths[0]), int(step.shortest[0])
        illegal = {META: int(ledger.illegal_goals[0]), CONTROLLER: int(ledger.illegal_actions[0])}
        return {
            agent: {"goal_event": event, "elapsed": elapsed[agent], "illegal_actions": illegal[agent], **ending}
            for agent in AGENTS
        }

    def render(self) -> str | NDArray[np.uint8] | None:
        """The level as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        if not self._is_seeded:
            raise InputError("reset the environment before it is rendered")
        return self._screen.render(self.turns.world.state, int(self.turns.goals[0]))

    def close(self) -> None:
        """Close the window, if one is open."""
        self._screen.close()

    def _show(self) -> None:
        self._screen.show(self.turns.world.state, int(self.turns.goals[0]))
