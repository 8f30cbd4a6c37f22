"""N environments of a task that come as one vector environment of Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Discrete
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

from hierroom.support.env_results import MOST_ELAPSED
from hierroom.support.errors import InputError, raise_in_one_line, shown, user_code
from hierroom.worlds.task.masks import MaskPlace, find_mask
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.spaces import flat_entries, read_batch, read_entry

_MOST = 2**62


class Seen(NamedTuple):
    """The observations of N environments by entry, [N, ...] each, values of goals [N, G], and masks [N, A]."""

    entries: dict[str, NDArray]
    totals: NDArray
    masks: NDArray[np.bool_] | None


class VectorStep(NamedTuple):
    """The results of a step; where it ended an episode, ``last`` is what ended, and ``now`` what the vector shows."""

    last: Seen
    now: Seen
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    elapsed: NDArray[np.int64] | None


class VectorEnvs:
    """A vector environment, ``env``, as the task's ``make_vec`` returned it.

    Attributes:
        mode: when it begins the next episode.
        can_reset: whether it begins episodes in some of its environments when it is asked to.
        are_counts, mask, entries: [G] whether each goal is a count, where masks are, and the path and the space of each
            entry of the observation; known after a reset.
        infos: those of the last reset or step.
    """

    def __init__(self, task: TaskParts, num_envs: int) -> None:
        self._name, self._goals, self._mask_name, self._n = task.name, task.goals, task.action_mask, num_envs
        self.env = task.new_vector(num_envs)
        self.mode = AutoresetMode(self.env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP))
        takes_mask = isinstance(self.env.unwrapped, (SyncVectorEnv, AsyncVectorEnv))
        self.can_reset = num_envs == 1 or takes_mask or self.mode is AutoresetMode.DISABLED
        self.are_counts: tuple[bool, ...] = ()
        self.mask: MaskPlace | None = None
        self.entries, _ = flat_entries(self.env.single_observation_space)
        self.infos: dict[str, Any] | None = None

    def reset(self, seed: int | None, where: NDArray[np.bool_] | None = None) -> Seen:
        """Begin episodes in the environments ``where`` [N], by default in all, and return what all show."""
        options = None if where is None or where.all() else {"reset_mask": where.copy()}
        with user_code(f"reset of {self._name}"):
            result = self.env.reset(seed=seed, options=options)
            if not (isinstance(result, tuple) and len(result) == 2 and isinstance(result[1], dict)):
                raise InputError(f"reset of {self._name} must return a tuple (observation, info), not {shown(result)}")
            batch, infos = result
            if self.infos is None:
                n = int(actions.n) if isinstance(actions := self.env.single_action_space, Discrete) else 0
                self.mask = find_mask(self._mask_name, n, self.env, batch, infos, self._name)
                self.entries = self.entries if self.mask is None else self.mask.left_out_of(self.entries)
            self.infos = infos
            return self._seen(self._read(batch), infos, self._masks(batch, infos))

    def _masks(self, batch: Any, infos: Mapping[str, Any]) -> NDArray[np.bool_] | None:
        return None if self.mask is None else self.mask.read(self.env, batch, infos, self._name, self._n)

    def step(self, actions: NDArray[np.integer]) -> VectorStep:
        """Act in all environments."""
        with user_code(f"step of {self._name}"):
            result = self.env.step(actions)
            if not (isinstance(result, tuple) and len(result) == 5 and isinstance(result[4], dict)):
                names = "(observations, rewards, terminated, truncated, infos)"
                raise InputError(f"step of {self._name} must return a tuple {names}, not {shown(result)}")
            batch, rewards, terminated, truncated, infos = result
            rewards = self._column(rewards, "finite numbers as rewards", "biuf")
            if np.count_nonzero(are_finite := np.isfinite(rewards)) < self._n:
                wrong = rewards[~are_finite][0]
                raise InputError(f"step of {self._name} must return finite numbers as rewards, not {wrong}")
            terminated = self._column(terminated, "True or False as terminated", "b")
            truncated = self._column(truncated, "True or False as truncated", "b")
            entries, rows, self.infos = self._read(batch), np.flatnonzero(terminated | truncated), infos
            masks = self._masks(batch, infos)
            if self.mode is not AutoresetMode.SAME_STEP or not len(rows):
                last = now = self._seen(entries, infos, masks)
            else:
                infos_now = {name: value for name, value in infos.items() if name.lstrip("_") not in _FINAL}
                last_entries, final = self._final(entries, infos.get("final_obs"), rows), infos.get("final_info")
                if not isinstance(final, dict) and (infos_now or final is not None):
                    rule = "must give the infos of ended episodes as a dict final_info"
                    raise InputError(f"step of {self._name}, a vector in mode SAME_STEP, {rule}, not {shown(final)}")
                infos = _merged(infos_now, final or {}, rows)
                last, now = self._seen(last_entries, infos, masks), self._seen(entries, infos_now, masks)
            if (elapsed := infos.get("elapsed")) is not None:
                elapsed = self._column(elapsed, "info['elapsed'] as whole numbers", "iu").clip(0, MOST_ELAPSED)
        return VectorStep(last, now, rewards.astype(np.float64), terminated, truncated, elapsed)

    def _column(self, values: Any, what: str, kinds: str) -> NDArray:
        array = np.asarray(values)
        if array.shape != (self._n,) or array.dtype.kind not in kinds:
            given = f"an array of {array.dtype} and shape {array.shape}"
            raise InputError(f"step of {self._name} must return {self._n} {what}, not {given}")
        return array

    def _read(self, batch: Any) -> dict[str, NDArray]:
        entries = self.entries.items()
        return {name: read_batch(batch, self._n, name, path, one, self._name) for name, (path, one) in entries}

    def _final(self, entries: dict[str, NDArray], final: Any, rows: NDArray[np.integer]) -> dict[str, NDArray]:
        merged = {name: values.copy() for name, values in entries.items()}
        for name, (path, space) in self.entries.items():
            if isinstance(final, np.ndarray) and final.dtype == object:
                merged[name][rows] = read_entry([final[row] for row in rows], name, path, space, self._name)
            else:
                merged[name][rows] = read_batch(final, self._n, name, path, space, self._name)[rows]
        return merged

    def _seen(self, entries: dict[str, NDArray], infos: Mapping[str, Any], masks: NDArray[np.bool_] | None) -> Seen:
        """Ask all goals; they find the observations in the infos, too."""
        if not self._goals:
            return Seen(entries, np.zeros((self._n, 0), np.int64), masks)
        given = {"observation": entries["observation"] if [*entries] == ["observation"] else entries, **infos}
        are_counts, totals = [], np.empty((self._n, len(self._goals)), np.int64)
        for goal, (name, function) in enumerate(self._goals.items()):
            try:
                one = np.asarray(function(self.env, given))
            except Exception as error:
                raise_in_one_line(f"goal {name!r} of {self._name}", error)
            is_valid = one.shape == (self._n,) and one.dtype.kind in "biu"
            if not is_valid or (one.dtype.kind != "b" and not 0 <= one.min() <= one.max() < _MOST):
                rule = f"must return {self._n} truths or counts of at least 0, one for each environment of the vector"
                found = f"an array of {one.dtype} and shape {one.shape}" if one.ndim else shown(one.item())
                raise InputError(f"goal {name!r} of {self._name} {rule}, not {found}")
            are_counts.append(one.dtype.kind != "b")
            totals[:, goal] = one
        self.are_counts = tuple(are_counts)
        return Seen(entries, totals, masks)

    def close(self) -> InputError | None:
        """Close the vector, and return its error."""
        try:
            with user_code(f"close of {self._name}"):
                self.env.close()
        except InputError as error:
            return error


_FINAL = {"final_info", "final_obs"}


def _merged(infos: Mapping[str, Any], final: Mapping[str, Any], rows: NDArray[np.integer]) -> dict[str, Any]:
    """Return infos with the rows of the infos at the end of episodes."""
    merged = dict(infos)
    for name, value in final.items():
        ours = merged.get(name)
        if isinstance(value, Mapping):
            merged[name] = _merged(ours if isinstance(ours, Mapping) else {}, value, rows)
        elif isinstance(ours, np.ndarray) and np.shape(value) == ours.shape:
            merged[name] = ours.copy()
            merged[name][rows] = value[rows]
        else:
            merged[name] = value
    return merged
