"""The Gymnasium environments ``hierroom/EscapeRoom-{a..g}-v0``: the controller alone, in one environment or in many.

The goals come from a meta-controller inside the environment (none by default: flat). Observations, actions, ends and
infos are those of ``controller_0`` in `hierroom.aec_env`.

Version history: v0, the first.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hierroom.env_config import (
    FRAMES_PER_SECOND,
    NOVELTY_BONUS,
    EnvConfig,
    GoalMaskName,
    fresh_seed,
    known_arguments,
)
from hierroom.goals import NO_GOAL, GraphSpecs
from hierroom.meta import MetaController, make_meta, show_step
from hierroom.options import CONTROLLER
from hierroom.registered_env import PlayableEnv, RegisteredEnv
from hierroom.rewards import RewardSpec
from hierroom.single_env import SingleEnv
from hierroom.step import Step
from hierroom.turns import Turns
from hierroom.world.render import RENDER_MODES

MetaSpec = str | MetaController | Callable[..., Any]
"""Who picks the goals, as `make_meta` takes it."""


class EscapeRoom(PlayableEnv, gymnasium.Env):
    """One EscapeRoom, and in it the controller.

    Args:
        graph: one of these, or a list or tuple of them, of whose graphs each episode samples one: a letter ``"a"`` to
            ``"g"``, a `GoalGraph`, a path to a TOML file that describes one, ``"rooms:4"`` for every graph of 4 rooms,
            ``"hitting_time:20..30"`` or ``"expected_steps:90..150"`` for all graphs in between.
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
        super().reset(seed=seed)
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
            self.single.infos()[CONTROLLER],
        )

    def render(self) -> str | NDArray[np.uint8] | None:
        """The level as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self.single.render()

    def close(self) -> None:
        """Close the window, if one is open."""
        self.single.close()


class EscapeRooms(RegisteredEnv, VectorEnv):
    """N environments on the batch engine; where an episode ends the next one begins in the same step.

    Observations and infos are laid out as Gymnasium's own ``SyncVectorEnv`` lays out those of N `EscapeRoom` with
    ``env_index`` 0, 1, ... in its same-step mode: where an episode ended, ``final_obs`` and ``final_info`` tell of its
    last step, and everything else of the new episode.

    Args:
        num_envs: N.
        graph: one of these, or a list or tuple of them, of whose graphs each episode samples one: a letter ``"a"`` to
            ``"g"``, a `GoalGraph`, a path to a TOML file that describes one, ``"rooms:4"`` for every graph of 4 rooms,
            ``"hitting_time:20..30"`` or ``"expected_steps:90..150"`` for all graphs in between.
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
        meta: who picks the goals, as for `EscapeRoom`.
        threads: most threads to step with.

    Attributes:
        complexity: the `ComplexityReport` of its goal graph, or of the hardest one it may draw.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 - Gymnasium reads it from the class

    @known_arguments
    def __init__(
        self,
        num_envs: int = 1,
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
        meta: MetaSpec = "none",
        threads: int = 1,
    ):
        config = EnvConfig.of_arguments(locals())
        self.turns = Turns(config, num_envs, measure_shortest=True, threads=threads)
        self.complexity = self.turns.complexity
        self.meta = make_meta(meta)
        self.config = config
        self.num_envs = num_envs
        self.single_observation_space = self.turns.observation_space(CONTROLLER)
        self.single_action_space = self.turns.action_space(CONTROLLER)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._is_seeded = False

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode in every environment: the first one of a seed, or without a seed each one's next.

        Args:
            seed: 0 to 2**63 - 1; one for all environments, whose indices make their episodes differ.
            options: ``{"complexity": True}`` puts the complexity report into the infos; other keys are ignored.
        """
        self.turns.reset(fresh_seed() if seed is None and not self._is_seeded else seed)
        self._is_seeded = True
        super().reset(seed=seed)
        self.turns.ask(self.meta)
        infos = self._infos(np.full(self.num_envs, NO_GOAL), np.zeros(self.num_envs, np.int64))
        if (options or {}).get("complexity"):
            infos["complexity"] = self.complexity.to_dict()
        return self._observations(), infos

    def step(self, actions: NDArray[np.integer]):
        """Act once in every environment."""
        step = self.turns.step(actions)
        show_step(self.meta, step, self.turns)
        episode_ended = step.episode_ended
        infos = self._infos(np.where(episode_ended, NO_GOAL, step.events), np.where(episode_ended, 0, 1))
        if episode_ended.any():
            infos |= self._final_infos(step)
        self.turns.ask(self.meta)
        return self._observations(), step.rewards, step.terminated, step.truncated, infos

    def _observations(self) -> dict[str, NDArray]:
        return self.turns.observe(CONTROLLER, self.turns.due(CONTROLLER)).as_dict()

    def _infos(self, events: NDArray[np.integer], elapsed: NDArray[np.integer]) -> dict[str, Any]:
        infos = {"goal_event": events, "elapsed": elapsed, "illegal_actions": self.turns.ledger.illegal_actions.copy()}
        return _masked(infos, np.ones(self.num_envs, bool))

    def _final_infos(self, step: Step) -> dict[str, Any]:
        """What there is to say of the episodes that a step ended."""
        episode_ended = step.episode_ended
        info = {
            "goal_event": step.events,
            "elapsed": np.ones(self.num_envs, np.int64),
            "illegal_actions": step.illegal_actions,
            "success": step.terminated,
            "length": step.lengths,
            "shortest_length": step.shortest,
        }
        final_info = _masked(
            {name: np.where(episode_ended, values, np.zeros_like(values)) for name, values in info.items()},
            episode_ended,
        )
        final_obs = np.full(self.num_envs, None, object)
        ended = np.flatnonzero(episode_ended)
        observations = self.turns.final_observation(CONTROLLER, step, ended).as_dict()
        for m, n in enumerate(ended):
            final_obs[n] = {name: values[m] for name, values in observations.items()}
        return _masked({"final_obs": final_obs, "final_info": final_info}, episode_ended)


def _masked(infos: dict[str, Any], where: NDArray[np.bool_]) -> dict[str, Any]:
    """Infos with Gymnasium's entries that say which environments they tell of."""
    return infos | {f"_{name}": where.copy() for name in infos}
