"""Write episodes of any player as a Minari data set, for offline learning."""

from __future__ import annotations

import importlib
from dataclasses import fields
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np

from hierroom.agents.recorder import record
from hierroom.goals import plain_specs
from hierroom.meta import META_CONTROLLERS
from hierroom.runs.rollout import prepare
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER
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
    same environment, unless its reward or task is an object. This environment uses the agent's meta-controller if it is
    a built-in scripted one; otherwise it has no goals. Needs the package minari with its extra hdf5.

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
    turns, player = prepare(agent, env, episodes, num_envs, seed)
    buffers = []
    for n, episode in enumerate(record(turns, player, episodes, observations=True)):
        at_end = np.arange(len(episode)) == len(episode) - 1
        buffers.append(
            minari.data_collector.EpisodeBuffer(
                id=n,
                seed=episode.seed,
                observations=dict(episode.observations or {}),
                actions=episode.actions.astype(np.int64),
                rewards=episode.rewards,
                terminations=at_end & episode.terminated,
                truncations=at_end & episode.truncated,
            )
        )
    meta = agent.config.resolved_method.meta if isinstance(agent, TrainedAgent) and not agent.has_other_meta else None
    return minari.create_dataset_from_buffers(
        dataset_id,
        buffers,
        env=_spec(turns.config, meta),
        observation_space=turns.observation_space(CONTROLLER),
        action_space=turns.action_space(CONTROLLER),
        jpeg_encoding=False,  # JPEG would change the symbols
        **details,
    )


def _spec(config: EnvConfig, meta: str | None) -> Any:
    plain = {entry.name: getattr(config, entry.name) for entry in fields(EnvConfig)}
    plain = {name: value for name, value in plain.items() if value != getattr(EnvConfig(task=config.task), name)}
    plain["reward"] = "intrinsic" if config.reward is None else config.reward  # the default of `Turns`
    if not all(isinstance(plain.get(name, ""), str) for name in ("task", "reward")):
        return None
    plain |= {name: plain_specs(plain[name]) for name in ("graph", "exclude") if name in plain}
    plain |= {"layout": [one.to_dict() for one in config.layout]} if config.layout else {}
    plain |= {"meta": meta} if meta in META_CONTROLLERS else {}
    return gymnasium.make("hierroom/EscapeRoom-v0", **plain).spec
