"""The PettingZoo parallel environment: both agents act at every primitive step.

Agents, actions, observations, rewards and ends are those of `hierroom.aec_env`. At each step ``meta_0``'s action is
taken first: on its turn it gives the goal; at any other time only its 14th action (no goal: wait) is legal, and
anything else is taken as that. Then ``controller_0`` acts. When it is ``meta_0``'s turn the controller's observation
holds no goal yet: a policy that wants the new one asks the meta-controller first and puts ``GOAL_VECTORS[goal]`` there.

Version history: v0, the first.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from hierroom.envs.single_env import SingleEnv, as_action
from hierroom.goals import GraphSpecs
from hierroom.support.errors import InputError, shown
from hierroom.turns.ledger import AGENTS, META
from hierroom.turns.rewards import RewardSpec
from hierroom.worlds.env_config import (
    FRAMES_PER_SECOND,
    NOVELTY_BONUS,
    EnvConfig,
    GoalMaskName,
    LevelsName,
    known_arguments,
)
from hierroom.worlds.escape_room.global_state import global_state, state_space
from hierroom.worlds.escape_room.render import RENDER_MODES


class parallel_env(ParallelEnv):
    """The parallel environment.

    Args:
        graph: one of these, or a list or tuple of them, of whose graphs each episode samples one: a letter ``"a"`` to
            ``"g"``, a name such as ``"keys-0-1-exit-2"``, a `GoalGraph`, a path to a TOML file that describes one,
            ``"rooms:4"`` for every graph of 4 rooms, ``"hitting_time:20..30"`` or ``"expected_steps:90..150"`` for all
            graphs in between.
        exclude: graphs to leave out, given likewise and found however their rooms are numbered.
        size: cells of the grid's side, 11 to 63, outer walls included.
        max_steps: primitive steps after which an episode is truncated.
        drop_key: whether the controller has a sixth action that drops a key.
        reward: the controller's reward: ``extrinsic``, ``bonus``, ``intrinsic`` or ``novelty`` (see `EnvConfig`), or
            one of your own, as `make_reward` takes it.
        novelty_bonus: the reward ``novelty`` gives for each state entered for the first time in an episode.
        subgoal_horizon: primitive steps after which an option ends without its goal, or None for never.
        goal_mask: which goals are legal: ``reachable``, ``existing``, ``seen`` or ``none``.
        curriculum_stages: parts into which several graphs are cut, to go through from the easiest on.
        env_index: the index of the environment; with the seed it fixes the episodes.
        levels: training or evaluation, which have no layout in common whatever the seeds; None: all levels.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.

    Attributes:
        complexity: the `ComplexityReport` of its goal graph, or of the hardest one it may draw.
    """

    metadata = {  # noqa: RUF012 - PettingZoo reads it from the class
        "name": "hierroom_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": FRAMES_PER_SECOND,
    }

    @known_arguments
    def __init__(
        self,
        graph: GraphSpecs = "c",
        *,
        exclude: GraphSpecs = (),
        size: int = 19,
        max_steps: int = 1000,
        drop_key: bool = False,
        reward: RewardSpec = "intrinsic",
        novelty_bonus: float = NOVELTY_BONUS,
        subgoal_horizon: int | None = None,
        goal_mask: GoalMaskName = "reachable",
        curriculum_stages: int = 1,
        env_index: int = 0,
        levels: LevelsName | None = None,
        render_mode: str | None = None,
    ):
        self.single = SingleEnv(EnvConfig.of_arguments(locals()), render_mode)
        self.render_mode = render_mode
        self.complexity = self.single.complexity
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        self.observation_spaces = self.single.observation_spaces
        self.action_spaces = self.single.action_spaces
        self.state_space = state_space(size)

    def observation_space(self, agent: str) -> spaces.Space:
        """The observation space of an agent: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The action space of an agent: the same object at every call."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict | None = None):
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: ``{"complexity": True}`` puts the complexity report into the infos; other keys are ignored.

        Returns:
            (observations, infos), each a dict by agent.
        """
        infos = self.single.reset(seed, options)
        self.agents = list(AGENTS)
        return self._observations(), infos

    def step(self, actions: dict[str, int]):
        """Take both agents' actions, the meta-controller's first.

        Returns:
            (observations, rewards, terminations, truncations, infos), each a dict by agent.
        """
        if not self.agents:
            if not self.single.turns.world.has_begun:
                raise InputError("reset the environment before its first step")
            return {}, {}, {}, {}, {}
        if not isinstance(actions, Mapping):
            raise InputError(f"actions are a dict by agent, not {shown(actions)}")
        missing = [agent for agent in AGENTS if agent not in actions]
        if missing:
            raise InputError(f"a step needs an action of each agent, and has none of {' and '.join(missing)}")
        choice, action = (as_action(actions[agent]) for agent in AGENTS)  # before one of them is taken
        self.single.choose(choice)
        rewards, terminations, truncations = self.single.act(action)
        if terminations[META] or truncations[META]:
            self.agents = []
        return self._observations(), rewards, terminations, truncations, self.single.infos()

    def state(self) -> NDArray[np.uint8]:
        """The whole grid [size, size, 4], as `global_state` lays it out."""
        return global_state(self.single.turns, self.single.goal)

    def render(self) -> str | NDArray[np.uint8] | None:
        """The level as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self.single.render()

    def close(self) -> None:
        """Close the window, if one is open."""
        self.single.close()

    def _observations(self) -> dict[str, dict[str, NDArray]]:
        return {agent: self.single.observe(agent) for agent in AGENTS}
