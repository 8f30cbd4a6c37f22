"""A config put together: its environments, its agents, and the pair that a run has trained."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import torch

from hierroom.agents.curiosity import Curiosity
from hierroom.agents.features import GOAL_FEATURES, Features
from hierroom.agents.goal_network import GoalNetwork
from hierroom.agents.networks import first_features, make_network
from hierroom.agents.player import Pair
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.agents.warm_up import WarmUp
from hierroom.errors import InputError
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.ppo import Learner
from hierroom.meta import LEARNED, make_meta
from hierroom.options import CONTROLLER, META
from hierroom.training.config import TrainConfig
from hierroom.training.run_folder import RunFolder
from hierroom.turns import N_META_ACTIONS, Turns


def make_turns(
    config: TrainConfig,
    num_envs: int,
    seed: int,
    *,
    whole_interval: bool = False,
    autoreset: bool = True,
    measure_shortest: bool = False,
) -> Turns:
    """The environments of a config, and the turns taken in them.

    Args:
        config: what is trained.
        num_envs: how many environments.
        seed: of their first episodes.
        whole_interval: whether a curriculum's graphs are all drawn from at once, as to evaluate it.
        autoreset: as for `Turns`.
        measure_shortest: likewise.
    """
    env = replace(config.env, reward=config.pair.controller.reward)
    return Turns(
        replace(env, curriculum_stages=1) if whole_interval else env,
        num_envs,
        seed=seed,
        autoreset=autoreset,
        measure_shortest=measure_shortest,
        threads=config.threads,
        memories=controller_features(config).memories,
    )


def make_agents(config: TrainConfig) -> tuple[PPOAgent | ScriptedAgent, PPOAgent]:
    """The meta-controller and the controller of a config, untrained.

    Raises:
        InputError: if there is no such device, network or meta-controller, or a setting of theirs cannot be used.
    """
    if config.device != "cpu" and not _has_device(config.device):
        raise InputError(f"this machine has no device {config.device!r}; cpu is always there")
    return _make_meta_agent(config), _make_controller(config)


def controller_features(config: TrainConfig) -> Features:
    """What the controller's network reads.

    Raises:
        InputError: if a feature is unknown, or not for controllers.
    """
    if "goal-outcome" in config.features:
        raise InputError("goal-outcome is how the last option ended: one of meta_features, not of features")
    controller = config.pair.controller
    names = [name for name in config.features if controller.sees_goal or name not in GOAL_FEATURES]
    return Features([*first_features(controller.network), *names], config.env.n_actions)


def warm_start(controller: PPOAgent, config: TrainConfig, run: RunFolder) -> None:
    """Give the controller of a config the weights of a run's newest checkpoint.

    Raises:
        InputError: if the controllers differ in what they observe or can do or in their network, or there is no
            checkpoint.
    """
    before = run.config()
    for what, ours, theirs in (
        ("network", config.pair.controller.network, before.pair.controller.network),
        ("hidden_size", config.ppo.hidden_size, before.ppo.hidden_size),
        ("drop_key", config.env.drop_key, before.env.drop_key),
        ("features", " ".join(controller.features.names), " ".join(controller_features(before).names)),
    ):
        if ours != theirs:
            raise InputError(f"{run.path} cannot warm-start this run: its {what} is {theirs}, here it is {ours}")
    _take_weights(controller, run.load_checkpoint(), run)


def load_pair(
    run: RunFolder,
    num_envs: int,
    *,
    seed: int = 0,
    is_greedy: bool = False,
    meta: str | None = None,
    steps: int | None = None,
) -> Pair:
    """The trained agents of a run, ready to play in a number of environments, on the CPU wherever they were trained.

    Args:
        run: the run's folder.
        num_envs: how many environments they will play in.
        seed: fixes their actions.
        is_greedy: whether the controller takes its most probable action instead of drawing one.
        meta: another meta-controller than the run's, as `make_meta` takes it.
        steps: which checkpoint, by its steps; None for the newest.

    Raises:
        InputError: if the run has no such checkpoint, or it does not fit its config, or there is no such
            meta-controller.
    """
    config, state = replace(run.config(), device="cpu"), run.load_checkpoint(steps)
    controller = _make_controller(config)
    _take_weights(controller, state, run)
    if meta:
        goals = ScriptedAgent(make_meta(meta))
    else:
        goals = _make_meta_agent(config)
        try:
            if isinstance(goals, PPOAgent):
                goals.learner.take_weights(state["agents"][META]["learner"])
            else:
                goals.load_state_dict(state["agents"][META])
        except (RuntimeError, KeyError, ValueError) as error:
            raise InputError(f"the checkpoint of {run.path} does not fit its config.json") from error
    return freeze(goals, controller, num_envs, seed=seed, is_greedy=is_greedy)


def freeze(
    meta: PPOAgent | ScriptedAgent, controller: PPOAgent, num_envs: int, *, seed: int, is_greedy: bool = False
) -> Pair:
    """What two agents have learned so far, as a pair that plays in a number of environments of its own.

    Args:
        meta: the meta-controller.
        controller: the controller.
        num_envs: how many environments.
        seed: fixes the pair's actions.
        is_greedy: whether the controller takes its most probable action instead of drawing one. A policy that escapes
            whenever it draws can turn on the spot for ever when it is greedy. A learned meta-controller draws.
    """
    goals = meta.frozen(num_envs, seed=meta_seed(seed))
    return Pair({META: goals, CONTROLLER: controller.frozen(num_envs, seed=seed, is_greedy=is_greedy)})


def meta_seed(seed: int) -> int:
    """A seed for what a meta-controller draws, so that the controller, who has the run's own, draws other numbers."""
    return int(np.random.SeedSequence([seed, 1]).generate_state(1)[0])


def _make_controller(config: TrainConfig) -> PPOAgent:
    features, controller, ppo = controller_features(config), config.pair.controller, config.ppo
    network = partial(make_network, controller.network, vectors=features.vectors)
    curiosity = None
    if controller.is_curious:
        settings: dict[str, Any] = {"gamma": ppo.gamma, "seed": config.seed, "device": config.device}
        curiosity = Curiosity(features, config.num_envs, config.curiosity_weight, **settings)
    learner = Learner(
        AgentSpace(features.cardinalities, features.n_actions),
        config.num_envs,
        ppo,
        seed=config.seed,
        device=config.device,
        threads=config.threads,
        network=network,
    )
    return PPOAgent(features, learner, curiosity=curiosity)


def _make_meta_agent(config: TrainConfig) -> PPOAgent | ScriptedAgent:
    if config.pair.meta != LEARNED:
        return ScriptedAgent(make_meta(config.pair.meta, config.num_envs), is_training=True)
    features = Features(config.meta_features, config.env.n_actions)
    learner = Learner(
        AgentSpace(features.cardinalities, N_META_ACTIONS),
        config.num_envs,
        config.meta_ppo,
        seed=meta_seed(config.seed),
        device=config.device,
        threads=config.threads,
        network=GoalNetwork,
    )
    return PPOAgent(features, learner, warm_up=WarmUp(config.meta_start_success), hindsight=True)


def _take_weights(controller: PPOAgent, state: dict[str, Any], run: RunFolder) -> None:
    try:
        controller.learner.take_weights(state["agents"][CONTROLLER]["learner"])
    except (RuntimeError, KeyError) as error:
        raise InputError(f"the newest checkpoint of {run.path} does not fit its config.json") from error


def _has_device(device: str) -> bool:
    try:
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError):
        return False
    return True
