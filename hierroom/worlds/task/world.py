"""N environments of a task as a world."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.support.errors import InputError, warn_once
from hierroom.support.schema import Array, Table
from hierroom.worlds.base import BaseWorld
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.task.local_envs import LocalEnvs, Taken
from hierroom.worlds.task.masks import all_forbidden
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.process_envs import ProcessEnvs
from hierroom.worlds.task.replayer import Moment, TaskReplayer, seeds_of
from hierroom.worlds.task.spaces import read_entry
from hierroom.worlds.window import StateScreen
from hierroom.worlds.world import Feature

_NONE = -1


class TaskWorld(BaseWorld):
    """N environments of a task, in this process or in ``task.processes`` others.

    Each episode has its own seed, determined by the run's seed, the environment's index and the episode's number. So
    an environment's episodes do not depend on the number of environments.

    A state is saved as its seed and the actions taken since; restoring it plays the actions again. If this does not
    give the same state, because the environment is not determined by its seed, the next step truncates the episode.

    Attributes:
        most_remembered: most actions of an episode that a checkpoint keeps, so that a resumed run can continue it.
        own_limit: steps after which its environments truncate an episode themselves; None if they do not say so.
    """

    most_remembered = 20_000

    def __init__(self, task: TaskParts, config: EnvConfig, num_envs: int, **settings: Any) -> None:
        self.task, self._trial, self.label = task, task.trial, task.label
        self.goals, self.actions = task.goal_set, self._trial.actions
        self.n_actions = self.actions.n
        self.rules = task.rules and replace(task.rules, label=task.name)
        self.is_repeatable = np.array(self._trial.are_counts, bool)
        self.observation_spaces: dict[str, spaces.Space] = {name: one for name, (_, one) in self._trial.entries.items()}
        self.default_max_steps, self.own_limit = task.max_steps, self._trial.limit
        left_out = ", ".join(self._trial.left_out)
        self.notes = [f"observations are without {left_out}, which no network reads"] if left_out else []
        self._shown = {
            name: np.zeros((num_envs, *(space.shape or ())), space.dtype)
            for name, space in self.observation_spaces.items()
        }
        self._totals = np.zeros((num_envs, len(self.goals)), np.int64)
        n_remembered = min(config.max_steps or task.max_steps, self.most_remembered)
        self._taken = np.zeros(num_envs, np.int64)
        self._none = np.array(_NONE).astype(self.actions.kept_type)  # unsigned ones have no -1
        self._actions = np.full((num_envs, n_remembered, *self.actions.shape), self._none, self.actions.kept_type)
        self._cut = np.zeros(num_envs, bool)
        self.action_masks = None if self._trial.mask is None else np.ones((num_envs, self.n_actions), bool)
        self._envs = self._make_envs(num_envs)
        super().__init__(config, num_envs, **settings)

    def _make_envs(self, num_envs: int, render_mode: str | None = None) -> LocalEnvs | ProcessEnvs:
        if self.task.processes:
            return ProcessEnvs(self.task, num_envs, render_mode)
        return LocalEnvs(self.task, num_envs, render_mode, self._trial.mask)

    def screen(self, render_mode: str | None) -> StateScreen:
        """Return a screen; for pictures, first make the environments anew with render mode ``rgb_array``."""
        if render_mode not in ("rgb_array", "human"):
            return super().screen(render_mode)
        self.close()
        self._envs = self._make_envs(len(self), "rgb_array")
        return StateScreen(self._drawn_state, self.replayer, render_mode)

    def _drawn_state(self, env: int) -> Moment:
        return replace(self.get_state(env), frame=self._envs.render(env))

    def close(self) -> None:
        """Close the task's environments, and end their processes; an error of theirs is only a warning."""
        if error := self._envs.close():
            warn_once(str(error))

    @property
    def replayer(self) -> TaskReplayer:  # pyright: ignore[reportIncompatibleVariableOverride] - copies have none
        """The replayer, which replays episodes and draws them."""
        return self.task.replayer

    @property
    def features(self) -> Mapping[str, Feature]:  # pyright: ignore[reportIncompatibleVariableOverride] - copies have none
        """Features that networks can read, by name."""
        return self.task.features

    def begin(self, envs: NDArray[np.integer]) -> None:
        """Begin the episodes of environments [M], each with its own seed."""
        seeds = seeds_of(self._episodes.take(envs, axis=0), self.config.levels)
        self._note(self._where(envs), *self._envs.reset(envs.tolist(), seeds), np.zeros(len(envs), bool))
        self._taken[envs], self._actions[envs], self._cut[envs] = 0, self._none, False

    def _begin_next(self, envs: NDArray[np.integer]) -> None:
        super()._begin_next(envs)
        if self.dependencies is not None:
            self._markings[envs] = self.dependencies.at_start(self._totals[envs])

    def identity(self, env: int) -> tuple[int, int, int, str | None]:
        """Return the identity of an environment's episode: seed, environment, episode number and set of levels."""
        return *self._episodes[env].tolist(), self.config.levels

    def _note(
        self, where: NDArray[np.integer] | slice, observations: Sequence[Any], totals: NDArray, ended: NDArray[np.bool_]
    ) -> None:
        """Keep what environments show, their masks, and the values of their goals; an episode may have ``ended``."""
        if self.action_masks is not None:
            observations, masks = zip(*observations, strict=True)
            self._note_masks(where, np.array(masks), ended)
        for name, (path, space) in self._trial.entries.items():
            self._shown[name][where] = read_entry(observations, name, path, space, self.variants[0])
        self._totals[where] = totals

    def _note_masks(self, where: NDArray[np.integer] | slice, masks: NDArray[np.bool_], ended: Any) -> None:
        assert self.action_masks is not None
        is_any = np.any(masks, axis=1)
        if not (is_any | ended).all():
            raise InputError(all_forbidden(self.variants[0]))
        self.action_masks[where] = masks | ~is_any[:, None]

    def shown(self, envs: NDArray[np.integer]) -> dict[str, NDArray]:
        """Return the observations of environments [M], by name."""
        return {name: self.rows(array, envs) for name, array in self._shown.items()}

    def step(self, actions: NDArray) -> np.ndarray:
        """Act once in every environment; an action that does not exist only costs the step."""
        n = len(actions)
        acts = self.actions.are_legal(actions) > self._has_ended
        if np.count_nonzero(acts) == n:
            times, taken = self._act(self.everywhere, actions)
            _, rewards, terminated, truncated, _, elapsed = taken
        else:
            rewards, elapsed, (terminated, truncated) = np.zeros(n), np.zeros(n, np.int64), np.zeros((2, n), bool)
            times = np.zeros_like(self._totals)
            if len(envs := np.flatnonzero(acts)):
                times[envs], taken = self._act(envs, actions[envs])
                _, rewards[envs], terminated[envs], truncated[envs], _, elapsed[envs] = taken
        outcomes = self.record(times, rewards, terminated, truncated | self._cut)
        if np.count_nonzero(elapsed):
            outcomes["elapsed"] = elapsed
        return outcomes

    def _act(self, envs: NDArray[np.integer], actions: NDArray) -> tuple[NDArray[np.int64], Taken]:
        """Act in environments [M]; return how often this achieved each goal [M, G], and what the environments gave."""
        taken, where = self._envs.step(envs.tolist(), self.actions.for_envs(actions)), self._where(envs)
        times = np.maximum(taken.totals - self._totals[where], 0)
        self._note(where, taken.observations, taken.totals, self._have_ended(taken, times))
        self._actions[envs, np.minimum(self._taken[where], self._actions.shape[1] - 1)] = actions
        self._taken[where] += 1
        return times, taken

    def _have_ended(self, taken: Any, times: NDArray[np.int64]) -> NDArray[np.bool_]:
        ended = taken.terminated | taken.truncated
        return ended | (times[:, self.goals.target] > 0) if self.goals.has_target else ended

    def _where(self, envs: NDArray[np.integer]) -> NDArray[np.integer] | slice:
        return slice(None) if envs is self.everywhere else envs

    def get_state(self, envs: Any = slice(None)) -> Moment:
        """Return the state of one environment, without a picture."""
        (env,) = np.atleast_1d(self.everywhere[envs]).tolist()
        facts = self.counts[env].copy(), self.markings[env].copy(), int(self.lengths[env])
        return Moment(self.identity(env), self.max_steps, *facts)

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M], as fresh arrays."""
        own = {"taken": self._taken[envs], "actions_taken": self._actions[envs], "cut": self._cut[envs]}
        return {**super().get_arrays(envs), **own, "prints": np.array([self._print(env) for env in envs.tolist()])}

    def _print(self, env: int) -> int:
        parts = (*(array[env] for array in self._shown.values()), self._totals[env])
        return zlib.crc32(b"".join(np.ascontiguousarray(part).tobytes() for part in parts))

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays that `get_arrays` returned, by replaying the actions."""
        n = len(self)
        schema = {"cut": Array(np.bool_, (n,)), "taken": Array(np.int64, (n,), 0, self.max_steps)}
        low, high = (_NONE, self.n_actions - 1) if self.n_actions else (None, None)
        schema["actions_taken"] = Array(self._actions.dtype, self._actions.shape, low, high)
        schema["prints"] = Array(np.int64, (n,), 0, 2**32 - 1)
        Table(schema, is_open=True).check(arrays, "world")
        super().set_arrays(arrays)
        cut = arrays["cut"].copy()
        for env in range(len(self)):
            self.begin(np.array([env]))
            actions = arrays["actions_taken"][env][: int(arrays["taken"][env])]
            is_known = len(actions) == arrays["taken"][env] and self.actions.are_legal(actions).all()
            for action in actions if is_known else ():
                _, taken = self._act(np.array([env]), action[None])
                if taken.terminated[0] or taken.truncated[0]:
                    break
            if self._taken[env] != arrays["taken"][env] or self._print(env) != arrays["prints"][env]:
                self.begin(np.array([env]))
                cut[env] = True
        self._cut = cut
        fresh = int((cut & ~arrays["cut"]).sum())
        why = "its episodes do not repeat themselves, or are too long to be saved"
        if fresh:
            self.notes = [*self.notes, f"{fresh} of {len(self)} episodes of {self.variants[0]} begin anew: {why}"]
