"""N environments of a task in this process, and the pictures that they draw as RGB."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.support.env_results import elapsed_steps, reset_results, step_results
from hierroom.support.errors import InputError, shown, user_code
from hierroom.worlds.task.goal_values import as_totals, goal_values
from hierroom.worlds.task.masks import MaskPlace
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.window import without_window

LONGEST_SIDE = 1280
"""Most pixels of a side; of a larger picture, only every second, third, ... row and column is shown."""
_SLACK = 0.1  # by which floats may leave their range, as they do after interpolation


def as_picture(drawn: Any) -> NDArray[np.uint8]:
    """Return what an environment drew as a new RGB picture [H, W, 3] uint8, or refuse it.

    It may be grey [H, W] or [H, W, 1], RGB, or RGBA, of which alpha is left out: an array, a tensor or a PIL image.
    Floats are from 0 to 1, or to 255 if one is larger; whole numbers are from 0 to 255, or to 65535 in uint16.
    """
    from PIL import Image

    try:
        is_coded = isinstance(drawn, Image.Image) and drawn.mode[0] not in "IF"  # such as palettes, but not numbers
        array = np.asarray(drawn.convert("RGB") if is_coded else drawn)
    except ValueError:  # a list of unequal parts
        array = np.array(None)
    kind = array.dtype.kind
    if kind not in "buif" or array.ndim not in (2, 3) or array.shape[2:] not in ((), (1,), (3,), (4,)):
        given = f"{array.dtype} of shape {list(array.shape)}" if array.ndim else shown(drawn)
        raise InputError(f"render must return a picture, [H, W], [H, W, 3] or [H, W, 4], not {given}")
    if not array.size:
        raise InputError(f"render must return a picture with pixels, not one of shape {list(array.shape)}")
    every = -(-max(array.shape[:2]) // LONGEST_SIDE)
    array = np.atleast_3d(array)[::every, ::every, :3]
    if array.dtype != np.uint8:
        low, high = array.min(), array.max()
        slack = _SLACK if kind == "f" else 0
        most = 1 if kind == "b" or (kind == "f" and high <= 1 + slack) else 255
        if array.dtype.type is np.uint16 and high > most:
            most = 65535
        if not (low >= -slack and high <= most + slack):  # also if it is not a number
            raise InputError(f"render must return colours from 0 to 255, or floats from 0 to 1, not {low} to {high}")
        array = (array * (255 / most)).round().clip(0, 255).astype(np.uint8)
    return np.repeat(array, 3 // array.shape[2], axis=2)


class Taken(NamedTuple):
    """The results of a step in M environments, with one item for each."""

    observations: Sequence[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    totals: NDArray  # [M, G] values of the goals
    elapsed: NDArray[np.int64]  # [M] primitive steps of the actions; 0 where the environment does not report them


class LocalEnvs:
    """N environments that are stepped one after the other, ``envs``, as the task's ``make`` returned them.

    With a place of their ``mask``, each observation comes as a pair with it. ``infos`` are those of the last call.
    """

    def __init__(
        self, task: TaskParts, num_envs: int, render_mode: str | None = None, mask: MaskPlace | None = None
    ) -> None:
        self._name, self._goals, self.mask = task.name, task.goals, mask
        self.envs = [task.new_env(render_mode) for _ in range(num_envs)]
        self.infos: Sequence[dict[str, Any]] = ()

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[Sequence[Any], NDArray]:
        """Begin an episode in some environments; return their observations and goal values [M, G]."""
        chosen = [self.envs[number] for number in envs]
        with user_code(f"reset of {self._name}"):
            results = [env.reset(seed=seed) for env, seed in zip(chosen, seeds, strict=True)]
            observations, infos = reset_results(results, self._name)
            observations = self._with_masks(chosen, observations, infos)
            values = goal_values(self._goals, chosen, infos, self._name)
        return observations, as_totals(values, len(envs), self._goals, self._name)

    def step(self, envs: Sequence[int], actions: Sequence[Any]) -> Taken:
        """Act in some environments, at least one."""
        chosen = [self.envs[number] for number in envs]
        with user_code(f"step of {self._name}"):
            results = [env.step(action) for env, action in zip(chosen, actions, strict=True)]
            observations, rewards, terminated, truncated, infos = step_results(results, self._name)
            observations = self._with_masks(chosen, observations, infos)
            values = goal_values(self._goals, chosen, infos, self._name)
            elapsed = elapsed_steps(infos, self._name)
        totals = as_totals(values, len(envs), self._goals, self._name)
        return Taken(observations, rewards, terminated, truncated, totals, elapsed)

    def _with_masks(self, envs: Sequence[Any], observations: Sequence[Any], infos: Sequence[Any]) -> Sequence[Any]:
        self.infos = infos
        if self.mask is None:
            return observations
        given = zip(envs, observations, infos, strict=True)
        return [(observation, self.mask.read(env, observation, info, self._name)) for env, observation, info in given]

    def render(self, env: int) -> NDArray[np.uint8]:
        """Return an environment's picture [H, W, 3]."""
        with user_code("the environment", "cannot be drawn"), without_window():
            return as_picture(self.envs[env].render())

    def close(self) -> InputError | None:
        """Close all environments, and return the last error."""
        failure = None
        for env in self.envs:
            try:
                with user_code(f"close of {self._name}"):
                    env.close()
            except InputError as error:
                failure = error
        return failure
