"""The Gymnasium environments ``hierroom/EscapeRoom-{a..g}-v0``: the controller alone.

The goals come from a meta-controller inside the environment (none by default: flat). Observations, actions, ends and
infos are those of ``controller_0`` in `hierroom.aec_env`. Version history: v0, the first.
"""

from __future__ import annotations

import gymnasium
import numpy as np
from numpy.typing import NDArray

from hierroom.envs.registered_env import PlayableEnv
from hierroom.envs.single_env import SingleEnv
from hierroom.goals import GraphSpecs
from hierroom.meta import MetaSpec, make_meta
from hierroom.turns.ledger import CONTROLLER
from hierroom.turns.rewards import RewardSpec
from hierroom.worlds.env_config import (
    FRAMES_PER_SECOND,
    NOVELTY_BONUS,
    EnvConfig,
    GoalMaskName,
    LevelsName,
    known_arguments,
)
from hierroom.worlds.escape_room.render import RENDER_MODES


class EscapeRoom(PlayableEnv, gymnasium.Env):
    """One EscapeRoom, and in it the controller.

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
        env_index: the index of the (first) environment; with the seed it fixes the episodes.
        levels: training or evaluation, which have no layout in common whatever the seeds; None: all levels.
        meta: who picks the goals: a name, ``package.module:Class``, ``package.module:function``, or a
            meta-controller or function itself (see `hierroom.meta`).
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.

    Attributes:
        complexity: the `ComplexityReport` of its goal graph, or of the hardest one it may draw.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": FRAMES_PER_SECOND}  # noqa: RUF012 - read from the class

    @known_arguments
    def __init__(
        self,
        graph: GraphSpecs = "c",
        *,
        exclude: GraphSpecs = (),
        size: int = 19,
        max_steps: int = 1000,
        drop_key: bool = False,
        reward: RewardSpec = "extrinsic",
        novelty_bonus: float = NOVELTY_BONUS,
        subgoal_horizon: int | None = None,
        goal_mask: GoalMaskName = "reachable",
        curriculum_stages: int = 1,
        env_index: int = 0,
        levels: LevelsName | None = None,
        meta: MetaSpec = "none",
        render_mode: str | None = None,
    ):
        self.single = SingleEnv(EnvConfig.of_arguments(locals()), render_mode)
        self.meta = make_meta(meta)
        self.config = self.single.turns.config
        self.render_mode = render_mode
        self.complexity = self.single.complexity
        self.observation_space = self.single.observation_spaces[CONTROLLER]
        self.action_space = self.single.action_spaces[CONTROLLER]

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: ``{"complexity": True}`` puts the complexity report into the info; other keys are ignored.
        """
        infos = self.single.reset(seed, options)
        super().reset(seed=None if seed is None else int(seed))  # Gymnasium takes no number of NumPy's
        self.single.ask(self.meta)
        return self.single.observe(CONTROLLER), infos[CONTROLLER]

    def step(self, action: int):
        """Act once."""
        rewards, terminations, truncations = self.single.act(action)
        self.single.show_step(self.meta)
        self.single.ask(self.meta)
        return (
            self.single.observe(CONTROLLER),
            rewards[CONTROLLER],
            terminations[CONTROLLER],
            truncations[CONTROLLER],
            self.single.info(CONTROLLER),
        )

    def render(self) -> str | NDArray[np.uint8] | None:
        """The level as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self.single.render()

    def close(self) -> None:
        """Close the window, if one is open."""
        self.single.close()
