"""The Gymnasium environments ``hierroom/EscapeRoom-{a..g}-v0``: the controller alone.

A meta-controller inside the environment chooses the goals; by default there are none. Observations, actions, ends and
infos are those of ``controller_0`` in `hierroom.aec_env`. Version history: v0, the first.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from hierroom.envs.base import OnSingleEnv, RegisteredEnv
from hierroom.envs.single_env import SingleEnv
from hierroom.goals import GraphSpecs
from hierroom.meta import MetaSpec, NoGoals, make_meta, show_step
from hierroom.turns.records import CONTROLLER
from hierroom.worlds.env_config import FRAMES_PER_SECOND, EnvConfig
from hierroom.worlds.world import RENDER_MODES


class EscapeRoom(RegisteredEnv, OnSingleEnv, gymnasium.Env):
    """One EscapeRoom in which the controller acts.

    Args:
        graph: the goal graphs, as for `EnvConfig`.
        meta: what chooses the goals: a name, ``package.module:Class``, ``package.module:function``, or a
            meta-controller or function itself (see `hierroom.meta`).
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.
        **entries: other entries of the `EnvConfig`, by name; the reward is ``"extrinsic"`` unless it is given.

    Attributes:
        complexity: the report on its goal graph, on the hardest one it may draw, or on its rules; None if unknown.

    Examples:
        >>> env = gymnasium.make("hierroom/EscapeRoom-a-v0", meta="fixed-dfs", size=11)
        >>> observation, info = env.reset(seed=0)
        >>> observation["observation"].shape, env.action_space
        ((7, 7, 3), Discrete(5))
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": FRAMES_PER_SECOND}  # noqa: RUF012 - read from the class

    def __init__(
        self,
        /,
        graph: GraphSpecs = "c",
        *,
        meta: MetaSpec = "none",
        render_mode: str | None = None,
        **entries: Any,
    ):
        arguments = {"graph": graph, "reward": "extrinsic", **entries}
        self.meta = make_meta(meta)
        has_goals = not isinstance(self.meta, NoGoals)
        config = EnvConfig.of_arguments(arguments, ("meta", "render_mode"), has_goals=has_goals)
        self.single = SingleEnv(config, render_mode)
        self.config = config
        self.render_mode = render_mode
        self.observation_space = self.single.observation_spaces[CONTROLLER]
        self.action_space = self.single.action_spaces[CONTROLLER]

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: none; each key gives a warning.
        """
        infos = self.single.reset(seed, options)
        super().reset(seed=None if seed is None else int(seed))  # Gymnasium accepts no NumPy numbers
        self.single.ask(self.meta)
        return self.single.observe(CONTROLLER), infos[CONTROLLER]

    def step(self, action: Any):
        """Take an action of the controller, and return the results of Gymnasium's step."""
        single = self.single
        reward, _, terminated, truncated = single.act_alone(action)
        show_step(self.meta, single.turns)
        single.ask(self.meta)
        return single.observe(CONTROLLER), reward, terminated, truncated, single.info(CONTROLLER)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the legal actions, [A] bool, for sb3-contrib's MaskablePPO; [0] if actions are arrays."""
        return self.single.observation(CONTROLLER).masks[0].copy()

    def get_keys_to_action(self) -> dict[tuple[int, ...], int]:
        """Return the action of each key for `gymnasium.utils.play.play`, as the world defines them."""
        import pygame

        named = self.single.turns.world.keys_to_action
        return {(getattr(pygame, name),): action for name, action in named.items()}
