"""The Gymnasium vector environment of ``hierroom/EscapeRoom-{a..g}-v0``: many controllers on the batch engine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hierroom.envs.base import RegisteredEnv
from hierroom.envs.single_env import checked_options
from hierroom.envs.vector_arrays import VectorArrays
from hierroom.goals import GraphSpecs
from hierroom.meta import MetaSpec, NoGoals, make_meta, show_step, take_turn
from hierroom.support.errors import InputError, require_name, require_number, shown
from hierroom.turns.records import CONTROLLER
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import FRAMES_PER_SECOND, EnvConfig, fresh_seed
from hierroom.worlds.make import WorldMaker, find_task
from hierroom.worlds.seeds import is_list
from hierroom.worlds.world import Seeds

VECTOR_RENDER_MODES = ("ansi", "rgb_array")


class EscapeRooms(RegisteredEnv, VectorEnv):
    """N environments on the batch engine.

    Observations and infos have the layout of Gymnasium's ``SyncVectorEnv`` of N `EscapeRoom` with ``env_index`` 0, 1,
    ... The next episode begins in the next step, which ignores the action (``NEXT_STEP``); in the same step, with
    ``final_obs`` and ``final_info`` of the ended episode (``SAME_STEP``); or at the next ``reset`` (``DISABLED``).

    Args:
        num_envs: number N of environments.
        graph: the goal graphs, as for `EnvConfig`.
        max_episode_steps: the name of ``max_steps`` in Gymnasium's specs; the smaller one counts.
        meta: what chooses the goals, as for `EscapeRoom`.
        threads: largest number of threads that take steps.
        autoreset_mode: ``AutoresetMode.NEXT_STEP``, ``SAME_STEP`` or ``DISABLED``, or its value as text.
        copy: whether observations are new arrays; else each step overwrites those of the last one.
        render_mode: ``"ansi"``, ``"rgb_array"`` or None.
        **entries: other entries of the `EnvConfig`, by name; the reward is ``"extrinsic"`` unless it is given.

    Attributes:
        complexity: the report on its goal graph, on the hardest one it may draw, or on its rules; None if unknown.
        have_ended: [N] bool, whether the episode has ended and the next one has not begun.
        copies: whether observations are new arrays.

    Examples:
        >>> envs = gymnasium.make_vec("hierroom/EscapeRoom-a-v0", num_envs=4, size=11)
        >>> observations, infos = envs.reset(seed=0)
        >>> observations, rewards, terminated, truncated, infos = envs.step(np.zeros(4, int))
        >>> rewards.tolist()
        [0.0, 0.0, 0.0, 0.0]
    """

    metadata = {  # noqa: RUF012 - Gymnasium reads it from the class
        "autoreset_mode": AutoresetMode.NEXT_STEP,
        "render_modes": list(VECTOR_RENDER_MODES),
        "render_fps": FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        /,
        num_envs: int = 1,
        graph: GraphSpecs = "c",
        *,
        max_episode_steps: int | None = None,
        meta: MetaSpec = "none",
        threads: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        **entries: Any,
    ):
        others = ("max_episode_steps", "meta", "threads", "autoreset_mode", "copy", "render_mode")
        self.meta = make_meta(meta)
        arguments, has_goals = {"graph": graph, "reward": "extrinsic", **entries}, not isinstance(self.meta, NoGoals)
        config = EnvConfig.of_arguments(arguments, others, has_goals=has_goals)
        if max_episode_steps is not None:
            require_number("max_episode_steps", max_episode_steps, 1, is_whole=True)
            own = config.max_steps or cast(WorldMaker, find_task(config.task)).max_steps
            config = replace(config, max_steps=int(min(own, max_episode_steps)))
        modes = [mode.value for mode in AutoresetMode]
        mode = getattr(autoreset_mode, "value", autoreset_mode)
        require_name("autoreset_mode must be one of", mode, modes)
        require_name("render_mode of many environments must be one of", render_mode, (*VECTOR_RENDER_MODES, None))
        if not isinstance(copy, (bool, np.bool_)):
            raise InputError(f"copy must be True or False, not {shown(copy)}")
        self.autoreset_mode = AutoresetMode(mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._is_same_step = self.autoreset_mode == AutoresetMode.SAME_STEP
        self.turns = Turns(config, num_envs, measure_shortest=True, threads=threads, autoreset=self._is_same_step)
        self.config, self.num_envs, self.render_mode = config, num_envs, render_mode
        self.copies = bool(copy)
        self._arrays = VectorArrays(self.turns, copy=copy)
        self.single_observation_space = self.turns.observation_space(CONTROLLER)
        self.single_action_space = self.turns.action_space(CONTROLLER)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._is_seeded = False
        self.have_ended = np.zeros(num_envs, bool)
        self._has_ended = False  # whether any of them is True, which is all that most steps need
        self._screen = self.turns.world.screen(render_mode)

    @property
    def complexity(self) -> Any:
        """Return the report on the goal graph or rules, or on the hardest of several goal graphs; None if unknown."""
        return self.turns.world.complexity

    def reset(self, *, seed: Seeds = None, options: dict | None = None):
        """Begin an episode in every environment: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1: one for all environments (their indices make episodes differ), or a list with a seed
                or None for each.
            options: ``{"reset_mask": mask}``, [N] bool, begins an episode in those environments only; other
                keys give a warning.
        """
        options, seeds = checked_options(options, "reset_mask"), self._seeds(seed)
        where = self._reset_mask(options)
        if where.all():
            self.turns.reset(seeds)
            self._is_seeded = True
        elif not self._is_seeded:
            raise InputError("reset all environments before only some of them")
        else:
            some = [one for one, is_one in zip(seeds, where, strict=True) if is_one] if is_list(seeds) else seeds
            self.turns.reset(some, np.flatnonzero(where))
        self.have_ended = self.have_ended & ~where
        self._has_ended = bool(self.have_ended.any())
        super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
        take_turn(self.meta, self.turns)
        observations, infos = self._arrays.at_reset(where)
        self._show_last_goals(observations)
        return observations, infos

    def step(self, actions: NDArray[np.integer]):
        """Take actions [N], and return the results of Gymnasium's step."""
        turns, had_ended = self.turns, self._has_ended
        if had_ended and self.autoreset_mode == AutoresetMode.DISABLED:
            ended = ", ".join(map(str, np.flatnonzero(self.have_ended)))
            raise InputError(f"the episodes of environments {ended} have ended: reset them first, by their reset_mask")
        steps = turns.step(actions).records
        if had_ended:
            turns.reset_ended(np.flatnonzero(self.have_ended))
        show_step(self.meta, turns)
        take_turn(self.meta, turns)
        results = self._arrays.at_step(steps, begins_anew=self._is_same_step)
        if self._is_same_step:
            if turns.n_ended and (step := turns.last_step) is not None:
                results[4].update(self._arrays.final(step))
        elif had_ended or turns.n_ended:
            self.have_ended = results[2] | results[3]
            self._has_ended = bool(self.have_ended.any())
            self._show_last_goals(results[0])
        return results

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture [H, W, 3] of each environment, or the levels as text, with the current subgoals."""
        if self.render_mode is None:
            return None
        if not self._is_seeded:
            raise InputError("reset the environment before it is rendered")
        return tuple(self._screen.render(env, goal) for env, goal in enumerate(self.turns.goals.tolist()))

    def close_extras(self, **kwargs: Any) -> None:
        """Close the environments of a task; Gymnasium's ``close`` calls this."""
        self.turns.world.close()

    def _show_last_goals(self, observations: dict[str, NDArray]) -> None:
        if (step := self.turns.last_step) is not None and self._has_ended:
            vectors = self.turns.world.goals.vectors
            observations["goal"][self.have_ended] = vectors[step.goals[self.have_ended]]

    def _seeds(self, seed: Seeds) -> Seeds:
        if not is_list(seed):
            return fresh_seed() if seed is None and not self._is_seeded else seed
        if len(seed) != self.num_envs:
            raise InputError(f"seeds are one for all environments or {self.num_envs} of them, not {len(seed)}")
        return [fresh_seed() if one is None and not self._is_seeded else one for one in seed]

    def _reset_mask(self, options: dict) -> NDArray[np.bool_]:
        if "reset_mask" not in options:
            return np.ones(self.num_envs, bool)
        mask = options["reset_mask"]
        if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            given = f"{mask.dtype} and shape {mask.shape}" if isinstance(mask, np.ndarray) else repr(mask)
            raise InputError(f"reset_mask must be {self.num_envs} bool, at least one of them True, not {given}")
        return mask
