"""Make the environments and the two agents of a config, and copies of trained agents that only play."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import torch
from torch import nn

from hierroom.agents.config import DEFAULT_NETWORK
from hierroom.agents.curiosity import Curiosity
from hierroom.agents.features import Features
from hierroom.agents.goal_network import GoalNetwork
from hierroom.agents.networks import make_network
from hierroom.agents.player import Pair
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent, WarmUp
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.ppo import Learner
from hierroom.meta import LEARNED, make_meta
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import LevelsName
from hierroom.worlds.make import world_spec


def make_turns(
    config: TrainConfig, num_envs: int, seed: int, *, levels: LevelsName, measure_shortest: bool = False
) -> Turns:
    """Make the environments of a config, and their turns; only training levels come in stages of the curriculum."""
    method = config.resolved_method
    if method.meta != "none" and not len(world_spec(config.env).goals):
        named = f"method {config.agents.method} with meta-controller {method.meta}"
        raise InputError(f"{config.env.names[0]} has no goals to pick, so train it with method ppo, not {named}")
    stages = config.env.curriculum_stages if levels == "training" else 1
    memories = controller_features(config).memories  # parts of an episode that these features need
    if method.meta == LEARNED:
        memories += meta_features(config).memories
    return Turns(
        replace(config.env, reward=method.reward, levels=levels, curriculum_stages=stages),
        num_envs,
        seed=seed,
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


def make_agents(config: TrainConfig) -> tuple[PPOAgent | ScriptedAgent, PPOAgent]:
    """Make the meta-controller and the controller of a config, untrained."""
    pair, agents, ppo, num_envs = config.resolved_method, config.agents, config.ppo, config.num_envs
    world, device = world_spec(config.env), config.device
    try:  # torch knows names of devices that do not exist or hold no data
        torch.ones(1, device=device).item()
    except Exception as error:  # each kind of device fails in its own way
        raise InputError(f"this machine has no device {device!r} to compute on; cpu is always there") from error

    def make_learner(
        features: Features, ppo: PPOConfig, seed: int, network: Callable[[AgentSpace, int], nn.Module]
    ) -> Learner:
        sizes, actions = features.actions.sizes, features.actions
        space = AgentSpace(features.cardinalities, sum(sizes), features.arrays, actions.kind, sizes)
        return Learner(space, num_envs, ppo, seed=seed, device=device, threads=config.threads, network=network)

    features = controller_features(config)
    network = partial(make_network, agents.network, vectors=features.vectors, config=ppo)
    learner = make_learner(features, ppo, config.seed, network)
    curiosity = None
    if pair.is_curious:
        settings = {"gamma": ppo.gamma, "seed": config.seed, "device": device}
        curiosity = Curiosity(features, num_envs, agents.curiosity_weight, **settings)
    is_without = ppo.memory == "none" and agents.network == DEFAULT_NETWORK
    name = "without memory" if is_without else agents.network
    controller = PPOAgent(features, learner, network=name, curiosity=curiosity)
    if pair.meta != LEARNED:
        return ScriptedAgent(make_meta(pair.meta, num_envs), is_training=True), controller
    features = meta_features(config)
    network = partial(make_network, "recurrent", vectors=features.vectors, config=config.meta_ppo)
    if features.are_by_goal and world.goals.n_alike and config.meta_ppo.memory == "lstm":
        network = partial(GoalNetwork, n_alike=world.goals.n_alike)
    learner = make_learner(features, config.meta_ppo, derived_seed(config.seed, "meta"), network)
    warm_up = WarmUp(agents.meta_start_success, world.goals.has_target)
    return PPOAgent(features, learner, network=LEARNED, warm_up=warm_up), controller


def freeze(
    meta: PPOAgent | ScriptedAgent, controller: PPOAgent, num_envs: int, *, seed: int, is_greedy: bool = False
) -> Pair:
    """Return copies of the two agents, to play in other environments without learning; see `load` for greedy."""
    meta_agent = meta.frozen(num_envs, seed=derived_seed(seed, "meta"))
    return Pair({META: meta_agent, CONTROLLER: controller.frozen(num_envs, seed=seed, is_greedy=is_greedy)})


def derived_seed(seed: int, purpose: Literal["meta", "evaluation"]) -> int:
    """Return a seed for the meta-controller, as the controller uses the run's, or for other levels in evaluations."""
    return int(np.random.SeedSequence([seed, 1 if purpose == "meta" else 2]).generate_state(1)[0])
