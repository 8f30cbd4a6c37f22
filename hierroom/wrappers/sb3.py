"""The Stable-Baselines3 view: the batch engine's environments as a ``VecEnv``."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from gymnasium.vector import VectorEnv

from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms

if TYPE_CHECKING:
    from hierroom.wrappers.sb3_vec_env import BatchVecEnv


def sb3_view(envs: VectorEnv) -> BatchVecEnv:
    """Return environments of the batch engine as a ``VecEnv`` of Stable-Baselines3, many times faster than its own.

    Args:
        envs: N environments from `gymnasium.make_vec`, in any ``autoreset_mode``, perhaps with features.

    Returns:
        The ``VecEnv``. `seed` takes one seed for all environments; their indices make episodes differ. At the end of an
        episode the info has the entries of Stable-Baselines3, those of the environment, and ``is_success``;
        ``VecMonitor`` adds ``episode``. MaskablePPO finds ``action_masks``.

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
    try:
        from hierroom.wrappers.sb3_vec_env import BatchVecEnv
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "stable_baselines3":
            raise
        raise InputError("sb3_view needs Stable-Baselines3: pip install stable-baselines3") from None
    return BatchVecEnv(envs)
