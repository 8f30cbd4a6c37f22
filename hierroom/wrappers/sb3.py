"""The Stable-Baselines3 view: the batch engine's environments as a ``VecEnv``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER
from hierroom.vector_env import EscapeRooms

try:
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError:  # an extra
    VecEnv: Any = object


def sb3_view(envs: VectorEnv) -> BatchVecEnv:
    """Return environments of the batch engine as a ``VecEnv`` of Stable-Baselines3, many times faster than its own.

    Args:
        envs: N environments from `gymnasium.make_vec`, in any ``autoreset_mode``, perhaps with features.

    Returns:
        The ``VecEnv``. `seed` takes one seed for all environments; their indices make episodes differ. At the end of an
        episode the info has the entries of Stable-Baselines3, those of the environment, and ``is_success``, which is
        None without a target; ``VecMonitor`` adds ``episode``. MaskablePPO finds ``action_masks``.

    Examples:
        >>> envs = hierroom.sb3_view(gymnasium.make_vec("hierroom/EscapeRoom-a-v0", num_envs=4))
        >>> _ = envs.seed(0)
        >>> envs.reset()["observation"].shape
        (4, 7, 7, 3)
    """
    if not isinstance(envs, VectorEnv) or not hasattr(envs.unwrapped, "turns"):
        raise InputError(f"sb3_view takes what gymnasium.make_vec gives for an id of hierroom, not {envs!r}")
    if not cast(EscapeRooms, envs.unwrapped).copies:
        raise InputError("sb3_view takes environments with copy=True: Stable-Baselines3 keeps observations for later")
    if VecEnv is object:
        raise InputError("sb3_view needs Stable-Baselines3: pip install stable-baselines3")
    return BatchVecEnv(envs)


FINAL = ("final_obs", "final_info")
"""Entries of Gymnasium's infos that have another form in Stable-Baselines3."""


class BatchVecEnv(VecEnv):
    """N environments of the batch engine with the interface of Stable-Baselines3."""

    def __init__(self, envs: VectorEnv) -> None:
        self.envs = envs
        self._actions = np.zeros(envs.num_envs, np.int64)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)  # type: ignore[arg-type]

    def reset(self) -> Any:
        """Begin an episode in every environment: the first one of a seed given to `seed` before, else the next one."""
        observations, infos = self.envs.reset(seed=self._seeds[0], options=self._options[0])
        self.reset_infos = _by_environment(infos)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[np.integer]) -> None:
        """Keep the actions [N] for `step_wait`."""
        self._actions = np.array(actions)

    def step_wait(self) -> Any:
        """Take the actions; return (observations, rewards [N] float32, dones [N] bool, N infos)."""
        observations, rewards, terminated, truncated, given = self.envs.step(self._actions)
        dones, infos = terminated | truncated, _by_environment(given)
        if dones.any():
            ended = np.flatnonzero(dones)
            if "final_obs" in given:  # the next episodes have begun in the same step
                finals, last = _by_environment(given["final_info"], ended), given["final_obs"][ended]
                begun = infos
            else:
                finals = [{} for _ in ended]
                last = [{name: values[env] for name, values in observations.items()} for env in ended]
                observations, given = self.envs.reset(options={"reset_mask": dones.copy()})
                begun = _by_environment(given)
            has_target = cast(EscapeRooms, self.envs.unwrapped).turns.world.goals.has_target
            for n, final, observation in zip(ended, finals, last, strict=True):
                self.reset_infos[n] = begun[n]
                info = {**infos[n], **final}
                infos[n] = {
                    **info,
                    "is_success": info["success"] if has_target else None,
                    "terminal_observation": observation,
                    "TimeLimit.truncated": bool(truncated[n] and not terminated[n]),
                }
        return observations, rewards.astype(np.float32), dones, infos

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the legal actions, [N, A] bool."""
        turns = cast(EscapeRooms, self.envs.unwrapped).turns
        return np.array(turns.observe(CONTROLLER, turns.due(CONTROLLER)).masks)

    def get_images(self) -> list[Any]:
        """Return a picture [H, W, 3] of each environment, or None unless ``render_mode`` is ``"rgb_array"``."""
        return list(self.envs.render() or ()) if self.render_mode == "rgb_array" else [None] * self.num_envs

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute's value for each environment; all have the same value."""
        if attr_name == "render_mode":
            value = getattr(self.envs.unwrapped, attr_name, None)
        else:
            value = self.action_masks if attr_name == "action_masks" else getattr(self.envs, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: environments of the batch engine are not separate objects."""
        raise InputError(f"the environments of the batch engine have no attributes of their own to set, {attr_name}")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Return ``action_masks`` or ``render`` of each environment; there are no other methods."""
        methods: dict[str, Callable[[], Any]] = {"action_masks": self.action_masks, "render": self.envs.render}
        if method_name not in methods:
            raise AttributeError(
                f"environments of the batch engine have the methods {', '.join(methods)}, not {method_name}"
            )
        results = methods[method_name]()
        return [results if results is None else results[n] for n in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for each: environments of the batch engine are not wrapped one by one."""
        return [False for _ in self._get_indices(indices)]


def _by_environment(infos: Mapping[str, Any], envs: Any = slice(None)) -> list[dict[str, Any]]:
    names = [name for name in infos if not name.startswith("_") and name not in FINAL]
    tables = [name for name in names if isinstance(infos[name], Mapping)]  # from wrappers, such as ``episode``
    names = [name for name in names if name not in tables]
    columns = [infos[name][envs].tolist() for name in names]
    rows = [dict(zip(names, row)) for row in zip(*columns)]  # noqa: B905 - all have the same length, and this is faster
    for name in tables:
        for row, is_given, entry in zip(rows, infos[f"_{name}"][envs], _by_environment(infos[name], envs), strict=True):
            if is_given:
                row[name] = entry
    return rows
