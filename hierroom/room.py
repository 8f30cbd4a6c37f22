"""One EscapeRoom with its two agents: what the AEC and the parallel environment share."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.goals import NO_GOAL
from hierroom.settings import RoomSettings, fresh_seed
from hierroom.turns import N_META_ACTIONS, Step
from hierroom.world.render import Screen

META, CONTROLLER = "meta_0", "controller_0"
AGENTS = [META, CONTROLLER]
_ROOM = np.zeros(1, np.int64)


class Room:
    """A batch of one, in the terms of PettingZoo.

    Args:
        settings: what the environment is made of.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.

    Attributes:
        observation_spaces: the space of each agent's observations.
        action_spaces: the space of each agent's actions.
        complexity: the `ComplexityReport` of its goal graph.
        infos: of each agent: ``goal_event``, the goal id that the last primitive step achieved, or -1; ``elapsed``,
            primitive steps since its last turn; ``illegal_actions``, how many it took this episode; at the episode's
            end ``success``, ``length`` and ``shortest_length``.
    """

    def __init__(self, settings: RoomSettings, render_mode: str | None):
        self.turns = settings.turns()
        self.complexity = settings.complexity()
        self.observation_spaces = {META: self.turns.meta_space(), CONTROLLER: self.turns.controller_space()}
        self.action_spaces = {
            META: spaces.Discrete(N_META_ACTIONS),
            CONTROLLER: spaces.Discrete(self.turns.world.n_actions),
        }
        self.infos: dict[str, dict[str, Any]] = {}
        self._screen = Screen(render_mode)
        self._final: Step | None = None
        self._is_seeded = False

    def reset(self, seed: int | None, options: dict | None) -> None:
        """Begin an episode: the first one of a seed, or without a seed the next one."""
        if seed is None and not self._is_seeded:
            seed = fresh_seed()
        self._is_seeded = True
        self.turns.reset(seed)
        self._final = None
        self.infos = {agent: {"goal_event": NO_GOAL, "elapsed": 0, "illegal_actions": 0} for agent in AGENTS}
        if (options or {}).get("complexity"):
            for info in self.infos.values():
                info["complexity"] = self.complexity.to_dict()
        self._screen.show(self.turns.world.state, NO_GOAL)

    @property
    def is_meta_turn(self) -> bool:
        """Whether the meta-controller is to act next."""
        return bool(self.turns.is_meta_turn[0])

    def observe(self, agent: str) -> dict[str, NDArray]:
        """What an agent sees now, in fresh arrays."""
        if agent == CONTROLLER:
            sight = self.turns.sight(_ROOM) if self._final is None else self.turns.final_sight(self._final, _ROOM)
            observations = self.turns.controller_observations(sight)
        else:
            masks = self.turns.meta_masks(self.turns.situation(_ROOM))
            observations = self.turns.meta_observations(
                self.turns.meta_sight(_ROOM), self.turns.last_outcomes[_ROOM], masks
            )
        return {name: values[0] for name, values in observations.items()}

    def choose(self, action: int) -> None:
        """Take the meta-controller's action; one that is not legal counts as no goal."""
        masks = self.turns.meta_masks(self.turns.situation(_ROOM))
        is_legal = self.turns.choose(_ROOM, [action], masks)[0]
        self.infos[META]["illegal_actions"] += int(not is_legal)
        self._screen.show(self.turns.world.state, int(self.turns.goals[0]))

    def act(self, action: int) -> Step:
        """Take the controller's action and bring the infos up to date."""
        step = self.turns.step([action])
        for info, elapsed in ((self.infos[META], step.meta_elapsed[0]), (self.infos[CONTROLLER], 1)):
            info.pop("complexity", None)
            info["goal_event"], info["elapsed"] = int(step.events[0]), int(elapsed)
            if step.over[0]:
                info["success"] = bool(step.terminated[0])
                info["length"], info["shortest_length"] = int(step.lengths[0]), int(step.shortest[0])
        if step.over[0]:
            self._final = step
        self._screen.show(self.turns.world.state, int(step.goals[0]))
        return step

    def render(self) -> str | NDArray[np.uint8] | None:
        """The room as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self._screen.render(self.turns.world.state, int(self.turns.goals[0]))

    def close(self) -> None:
        """Close the window, if one is open."""
        self._screen.close()
