"""N environments of a task in several processes, by Gymnasium's `AsyncVectorEnv`."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from numpy.typing import NDArray

from hierroom.support.errors import InputError, RunError
from hierroom.worlds.task.local_envs import LocalEnvs, Taken
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.spaces import read_entry

_WAIT, _RESET, _STEP = range(3)
_SHOWN, _RESULTS = "shown_", ("rewards", "ends", "cuts", "totals")


class Block(gymnasium.Env):
    """Several environments of a task as one environment; an action lets each of them wait, reset or step.

    An action is [n, 2] int64: for each environment ``_WAIT``, ``_RESET`` or ``_STEP``, and the seed or action. An
    observation has the observations of all environments, by name, and the results of their last steps.
    """

    def __init__(self, task: TaskParts, n_envs: int, n_places: int, render_mode: str | None) -> None:
        self._task, self._envs = task, LocalEnvs(task, n_envs, render_mode)
        shape = (n_places,)
        entries = {f"{_SHOWN}{name}": space for name, (_, space) in task.trial.entries.items()}
        results = {name: spaces.Box(-np.inf, np.inf, shape, np.float64) for name in _RESULTS[:3]}
        most = np.iinfo(np.int64).max
        totals = spaces.Box(0, most, (n_places, len(task.goals)), np.int64)
        batches = {name: _batch(space, n_places) for name, space in entries.items()}
        self.observation_space = spaces.Dict({**batches, **results, "totals": totals})
        self.action_space = spaces.Box(-most, most, (n_places, 2), np.int64)
        self._arrays = {name: np.zeros(one.shape or (), one.dtype) for name, one in self.observation_space.items()}

    def close(self) -> None:
        """Close all environments."""
        self._envs.close()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Return the current arrays; environments are reset by actions."""
        return self._arrays, {}

    def step(self, action: NDArray[np.int64]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Reset or step the environments."""
        anew, stepped = (np.flatnonzero(action[:, 0] == kind).tolist() for kind in (_RESET, _STEP))
        if anew:
            self._keep(anew, *self._envs.reset(anew, action[anew, 1].tolist()))
        if stepped:
            taken = self._envs.step(stepped, action[stepped, 1].tolist())
            self._keep(stepped, taken.observations, taken.totals)
            for name, values in zip(_RESULTS, taken[1:4], strict=False):
                self._arrays[name][stepped] = values
        return self._arrays, 0.0, False, False, {}

    def _keep(self, envs: list[int], observations: Sequence[Any], totals: NDArray) -> None:
        for name, (path, space) in self._task.trial.entries.items():
            self._arrays[f"{_SHOWN}{name}"][envs] = read_entry(observations, name, path, space, self._task.name)
        self._arrays["totals"][envs] = totals

    def draw(self, env: int) -> Any:
        """Return an environment's picture [H, W, 3]."""
        return self._envs.render(env)


class ProcessEnvs:
    """N environments in several processes, with the interface of `LocalEnvs`."""

    def __init__(self, task: TaskParts, num_envs: int, render_mode: str | None = None) -> None:
        self._paths = {name: path for name, (path, _) in task.trial.entries.items()}
        n_blocks = min(task.processes, num_envs)
        self._n_places = -(-num_envs // n_blocks)
        n_blocks = -(-num_envs // self._n_places)
        sizes = [min(self._n_places, num_envs - n * self._n_places) for n in range(n_blocks)]
        make = [partial(_make_block, os.getpid(), task, size, self._n_places, render_mode) for size in sizes]
        self._blocks = AsyncVectorEnv(make, autoreset_mode=AutoresetMode.DISABLED)
        with _running():
            self._blocks.reset()

    def __reduce__(self) -> Any:
        """Refuse copies, which would share and close the pipes of the original."""
        raise InputError("environments in other processes cannot be copied; make the task with processes=0")

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[list[Any], NDArray]:
        """Begin an episode in some environments; return their observations and goal values [M, G]."""
        shown = self._send(_RESET, envs, seeds)
        return self._observations(shown, envs), shown["totals"][[*envs]]

    def step(self, envs: Sequence[int], actions: Sequence[int]) -> Taken:
        """Act in some environments."""
        shown, chosen = self._send(_STEP, envs, actions), [*envs]
        rewards, ends, cuts = (shown[name][chosen] for name in _RESULTS[:3])
        observations = self._observations(shown, envs)
        return Taken(observations, rewards, ends.astype(bool), cuts.astype(bool), shown["totals"][chosen])

    def _send(self, kind: int, envs: Sequence[int], values: Sequence[int]) -> dict[str, NDArray]:
        actions = np.zeros((self._blocks.num_envs * self._n_places, 2), np.int64)
        actions[[*envs], 0], actions[[*envs], 1] = kind, values
        with _running():
            shown, *_ = self._blocks.step(actions.reshape(self._blocks.num_envs, self._n_places, 2))
        return {name: array.reshape(-1, *array.shape[2:]) for name, array in shown.items()}

    def _observations(self, shown: dict[str, NDArray], envs: Sequence[int]) -> list[Any]:
        return [_nested({path: shown[f"{_SHOWN}{name}"][env] for name, path in self._paths.items()}) for env in envs]

    def render(self, env: int) -> NDArray[np.uint8]:
        """Return an environment's picture [H, W, 3]."""
        block, place = divmod(env, self._n_places)
        with _running():
            return self._blocks.call("draw", place)[block]

    def close(self) -> None:
        """End the processes."""
        self._blocks.close()


@contextmanager
def _running() -> Iterator[None]:
    try:
        yield
    except (EOFError, ConnectionError) as error:
        raise RunError("a process of the task's environments has ended, perhaps killed for memory") from error


def _make_block(parent: int, task: TaskParts, n_envs: int, n_places: int, render_mode: str | None) -> Block:
    """Return a block; in a process of its own, first replace what a fork inherits from a training run.

    The run's signal handlers only note a signal, and its `AsyncVectorEnv`s complain if collected in another process.
    Ctrl-C reaches all processes; this one ignores it, because its parent ends it.
    """
    if os.getpid() != parent:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        gc.freeze()
    return Block(task, n_envs, n_places, render_mode)


def _batch(space: spaces.Space, n: int) -> spaces.Box:
    dtype: Any = space.dtype
    kinds = {"f": (-np.inf, np.inf), "b": (0, 1)}
    low, high = kinds[dtype.kind] if dtype.kind in kinds else (np.iinfo(dtype).min, np.iinfo(dtype).max)
    return spaces.Box(low, high, (n, *(space.shape or ())), dtype)


def _nested(parts: dict[tuple[Any, ...], NDArray]) -> Any:
    nested: dict[Any, Any] = {}
    for path, value in parts.items():
        if not path:
            return value
        inner = nested
        for key in path[:-1]:
            inner = inner.setdefault(key, {})
        inner[path[-1]] = value
    return nested
