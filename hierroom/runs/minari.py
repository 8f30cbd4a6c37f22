"""Write episodes of any player as a Minari data set, for offline learning."""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import fields, replace
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec

from hierroom.agents.player import Pair
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.goals import NO_GOAL, plain_specs
from hierroom.meta import META_CONTROLLERS
from hierroom.runs.rollout import play_episodes, prepare
from hierroom.support.errors import InputError, shown
from hierroom.support.files import usable_path
from hierroom.turns.records import CONTROLLER, META
from hierroom.worlds.env_config import EnvConfig


def minari_dataset(
    dataset_id: str,
    agent: Any,
    env: Any = None,
    episodes: int = 100,
    *,
    num_envs: int = 100,
    seed: int = 0,
    **details: Any,
) -> Any:
    """Let an agent play, and write its episodes as a Minari data set.

    An episode has the controller's observations, actions and rewards. The data set's ``recover_environment`` makes the
    same environment, with the player's meta-controller. If the reward or the task is an object it makes none, and if
    the meta-controller is not a built-in scripted one the environment has no goals; the description says so. Needs the
    package minari with its extra hdf5.

    Args:
        dataset_id: a new name, such as ``"hierroom/c/hippo-v0"``.
        agent: the player, as for `rollout`.
        env: the environment, as for `rollout`.
        episodes: number of episodes.
        num_envs: environments that play in parallel.
        seed: determines the environments and the actions.
        **details: ``author``, ``description`` and so on, for ``minari.create_dataset_from_buffers``.

    Returns:
        The data set, as from ``minari.load_dataset``.

    Examples:
        >>> config = hierroom.EnvConfig("a", size=11)
        >>> hierroom.minari_dataset("hierroom/a/random-v0", "random", config, episodes=2).total_episodes
        2
    """
    if find_spec("minari") is None or find_spec("h5py") is None:
        raise InputError('to write a Minari data set install minari (pip install "minari[hdf5]")')
    minari: Any = importlib.import_module("minari")
    try:
        minari.dataset.minari_dataset.parse_dataset_id(dataset_id)
    except (TypeError, ValueError) as error:
        raise InputError(f"Minari takes no data set of this name: {error}") from error
    if dataset_id in minari.list_local_datasets():
        raise InputError(f"there is a data set {dataset_id} already: delete it, or give another name")
    usable_path(minari.storage.get_dataset_path(dataset_id))
    turns, player = prepare(agent, env, episodes, num_envs, seed)
    space, space_of_actions = turns.observation_space(CONTROLLER), turns.action_space(CONTROLLER)
    _require_hdf5_names(space)
    agent = player.agents.get(META) if isinstance(player, Pair) else None
    kind = type(agent.meta) if isinstance(agent, ScriptedAgent) else None
    meta = next((name for name, one in META_CONTROLLERS.items() if one is kind), "none")
    spec, note = env_spec(turns.config, meta)
    buffers, has_goals = [], False
    for n, episode in enumerate(play_episodes(turns, player, episodes, observations=True)):
        at_end = np.arange(len(episode)) == len(episode) - 1
        has_goals |= bool((episode.goals != NO_GOAL).any())
        buffers.append(
            minari.data_collector.EpisodeBuffer(
                id=n,
                seed=episode.seed,
                observations=dict(episode.observations or {}),
                actions=episode.actions.astype(space_of_actions.dtype),
                rewards=episode.rewards,
                terminations=at_end & episode.terminated,
                truncations=at_end & episode.truncated,
            )
        )
    if spec is not None and has_goals and meta == "none":
        note = "A recovered environment has no goals: their meta-controller is not a built-in scripted one."
    description = " ".join(filter(None, (details.get("description"), note)))
    return minari.create_dataset_from_buffers(
        dataset_id,
        buffers,
        env=spec,
        observation_space=space,
        action_space=space_of_actions,
        jpeg_encoding=False,  # JPEG would change the symbols
        **{**details, "description": description or None},
    )


def _require_hdf5_names(names: Iterable[str]) -> None:
    """Refuse entries of an observation that HDF5 would store under another name, such as ``a/b``."""
    h5py: Any = importlib.import_module("h5py")
    with h5py.File(io.BytesIO(), "w") as file:
        for name in names:
            with suppress(OSError, TypeError, ValueError):
                file[name] = 0
            if name not in [*file]:
                raise InputError(f"Minari's files cannot hold an entry of an observation called {shown(name)}")


def env_spec(config: EnvConfig, meta: str) -> tuple[EnvSpec | None, str]:
    """Return the spec that makes the environment again, with every entry, or why there is none."""
    entries = {entry.name: getattr(config, entry.name) for entry in fields(config)}
    for name in ("reward", "task"):
        if not isinstance(entries[name], str | None):
            return None, f"The environment cannot be recovered: its {name} is an object, not a name."
    entries |= {name: plain_specs(entries[name]) for name in ("graph", "exclude")}
    entries |= {"layout": [one.to_dict() for one in config.layout], "meta": meta}
    return replace(gymnasium.spec("hierroom/EscapeRoom-v0"), kwargs=entries, max_episode_steps=config.max_steps), ""
