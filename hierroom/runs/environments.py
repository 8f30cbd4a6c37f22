"""The environments of a config, and the features of its agents. This module does not import torch."""

from __future__ import annotations

from dataclasses import replace

from hierroom.agents.features import Features
from hierroom.meta import LEARNED
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.turns.records import META
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import LevelsName
from hierroom.worlds.make import world_spec


def make_turns(
    config: TrainConfig,
    num_envs: int,
    seed: int,
    *,
    levels: LevelsName,
    autoreset: bool = True,
    measure_shortest: bool = False,
) -> Turns:
    """Make the environments of a config, and their turns; only training levels come in stages of the curriculum."""
    method = config.resolved_method
    stages = config.env.curriculum_stages if levels == "training" else 1
    memories = controller_features(config).memories  # parts of an episode that these features need
    if method.meta == LEARNED:
        memories += meta_features(config).memories
    return Turns(
        replace(config.env, reward=method.reward, levels=levels, curriculum_stages=stages),
        num_envs,
        seed=seed,
        autoreset=autoreset,
        measure_shortest=measure_shortest,
        threads=config.threads,
        memories=memories,
    )


def controller_features(config: TrainConfig) -> Features:
    """Return the features of a config's controller."""
    world = world_spec(config.env)
    features = Features(world, config.agents.features or world.controller_features)
    if config.resolved_method.sees_goal:
        return features
    names = features.subset(of_goal=False)
    if not names:
        named = ", ".join(features.names)
        raise InputError(f"method {config.agents.method} does not see goals, so features must name more than {named}")
    return Features(features.world, names)


def meta_features(config: TrainConfig) -> Features:
    """Return the features of a config's learned meta-controller."""
    world = world_spec(config.env)
    return Features(world, config.agents.meta_features or world.meta_features, META)
