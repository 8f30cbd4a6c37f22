"""A rehearsal of a run, which compiles the run's kernels in two processes before it begins."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hierroom.meta import LEARNED
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.environments import controller_features, make_turns, meta_features
from hierroom.runs.folder.trust import named_code
from hierroom.support.compile.kernel_folder import kernel_folder
from hierroom.support.compile.side_by_side import side_by_side
from hierroom.support.files import to_json
from hierroom.turns.records import CONTROLLER, META

if TYPE_CHECKING:
    from hierroom.learners.ppo import Learner

MOST_ENVS = 64
LAST = "recurrent_kernels.lstm_backward-*.nbc"
"""The kernel that a learner needs last: if it is on disk, almost nothing is left to compile."""


def rehearse(config: TrainConfig) -> None:
    """Compile the kernels of a run on the CPU, unless it has custom code or most kernels are compiled already."""
    folder = kernel_folder()
    if folder is None or named_code(config) or config.device != "cpu" or any(Path(folder).rglob(LAST)):
        return
    learner = f"from hierroom.runs.rehearsal import rehearse_learner; rehearse_learner({to_json(config.to_dict())!r})"
    with side_by_side(learner):
        rehearse_world(config)
        import torch  # noqa: F401 - the run needs it next


def rehearse_world(config: TrainConfig) -> None:
    """Take a few steps in a config's world, and encode its agents' features."""
    turns = make_turns(config, min(config.num_envs, MOST_ENVS), config.seed, levels="training")
    features = {CONTROLLER: controller_features(config)}
    if config.resolved_method.meta == LEARNED:
        features[META] = meta_features(config)
    for _ in range(3):
        for name in (META, CONTROLLER):
            observation = turns.observe(name, turns.due(name))
            if name in features and len(observation.envs):
                features[name].encode(observation)
            turns.act(name, observation, observation.masks.argmax(axis=1))
        turns.advance()


def rehearse_learner(text: str) -> None:
    """Update the learners of a config, given as JSON, once on dummy data, and compile the search for shortest paths."""
    from hierroom.agents.ppo_agent import PPOAgent
    from hierroom.learners.networks.actor_critic import RecurrentActorCritic
    from hierroom.learners.networks.initial_weights import one_torch_thread
    from hierroom.runs.assembly import make_agents

    config = TrainConfig.from_dict(json.loads(text))
    few = {"sequence_length": 2, "sequences_per_update": 4, "minibatches": 1, "epochs": 1}
    config = config.changed(num_envs=4, ppo=replace(config.ppo, **few), meta_ppo=replace(config.meta_ppo, **few))
    with one_torch_thread():
        for agent in make_agents(config):
            if isinstance(agent, PPOAgent) and type(agent.learner.network) is RecurrentActorCritic:  # others use torch
                _learn_from_nothing(agent.learner)
    if config.env.task is None:
        from hierroom.worlds.escape_room.oracle import compiled_solver

        compiled_solver()


def _learn_from_nothing(learner: Learner) -> None:
    n, space = learner.num_envs, learner.space
    envs, never = np.arange(n), np.zeros(n, bool)
    features, masks = np.zeros((n, space.n_features), np.uint8), np.ones((n, space.n_actions), bool)
    masks.setflags(write=False)
    while not learner.ready:
        learner.act(envs, features, masks)
        learner.finish(envs, np.zeros(n), np.ones(n, int), never, never, never)
    learner.bootstrap(envs, features)
    learner.update(0.0)
    learner.policy(n, seed=0).act(envs, features, masks)
