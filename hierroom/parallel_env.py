"""The PettingZoo parallel environment: both agents act at every primitive step.

Agents, actions, observations, rewards and ends are those of `hierroom.aec_env`. At each step, the action of ``meta_0``
is taken first. On its turn it sets the goal. At other times only its 14th action (no goal: wait) is legal, and any
other action counts as that. Then ``controller_0`` acts. On ``meta_0``'s turn, the controller's observation has no goal
yet. A policy that needs the new goal asks the meta-controller first and puts ``GOAL_VECTORS[goal]`` there.

Version history: v0, the first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from hierroom.envs.base import TwoAgentEnv, class_metadata
from hierroom.envs.single_env import as_action
from hierroom.support.errors import InputError, shown
from hierroom.turns.records import AGENTS, CONTROLLER, META


class parallel_env(TwoAgentEnv, ParallelEnv):
    """The parallel environment.

    Args:
        graph: the goal graphs, as for `EnvConfig`.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.
        **entries: other entries of the `EnvConfig`, by name; the reward is ``"intrinsic"`` unless it is given,
            and ``"extrinsic"`` in a task without goals.

    Attributes:
        complexity: the report on its goal graph, on the hardest one it may draw, or on its rules; None if unknown.

    Examples:
        >>> env = hierroom.parallel_env("a", reward="bonus")
        >>> observations, infos = env.reset(seed=0)
        >>> goal = int(np.flatnonzero(observations["meta_0"]["action_mask"])[0])
        >>> observations, rewards, terminations, truncations, infos = env.step({"meta_0": goal, "controller_0": 0})
        >>> rewards
        {'meta_0': 0.0, 'controller_0': 0.0}
    """

    metadata = class_metadata()

    def reset(self, seed: int | None = None, options: dict | None = None):
        """Begin an episode and return (observations, infos): the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: none; each key gives a warning.
        """
        infos = self.single.reset(seed, options)
        self.agents = list(AGENTS)
        return self._observations(), infos

    def step(self, actions: dict[str, Any]):
        """Take both agents' actions, first the meta-controller's, and return the results of PettingZoo's step."""
        if not self.agents:
            if not self.single.has_begun:
                raise InputError("reset the environment before its first step")
            return {}, {}, {}, {}, {}
        if not isinstance(actions, Mapping):
            raise InputError(f"actions are a dict by agent, not {shown(actions)}")
        if unknown := [shown(agent) for agent in actions if agent not in AGENTS]:
            raise InputError(f"the agents are {' and '.join(AGENTS)}; there is no {', '.join(unknown)}")
        missing = [agent for agent in AGENTS if agent not in actions]
        if missing:
            raise InputError(f"a step needs an action of each agent, and has none of {' and '.join(missing)}")
        choice, action = as_action(actions[META]), self.single.as_action(actions[CONTROLLER])  # before one is taken
        self.single.choose(choice)
        rewards, terminations, truncations = self.single.act(action)
        if terminations[META] or truncations[META]:
            self.agents = []
        return self._observations(), rewards, terminations, truncations, self.single.infos()

    def _observations(self) -> dict[str, dict[str, NDArray]]:
        return {agent: self.single.observe(agent) for agent in AGENTS}
