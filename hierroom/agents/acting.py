"""Trained agents in a user's loop: actions for the observations of any API, and a meta-controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.agents.features import CHOICE, ENTRY
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.learners.policy import Policy
from hierroom.support.errors import InputError, require_number, shown
from hierroom.turns.records import AGENTS, CONTROLLER, META
from hierroom.turns.situation import Situation

_WRAP = "wrap the environment by hierroom.add_features(env, agent)"


def act(
    controller: PPOAgent, observations: Any, state: Policy | None, *, begins: ArrayLike, is_greedy: bool, seed: int
) -> tuple[Any, Policy | None]:
    """Return actions and the next state: see `TrainedAgent.act`."""
    if not isinstance(observations, Mapping):
        raise InputError(f"observations must be dicts, not {shown(observations)}: {_WRAP}")
    if not (state is None or isinstance(state, Policy)):
        raise InputError(f"the state must come from the last act, or be None, not {shown(state)}")
    if META in observations and CONTROLLER in observations:
        chosen = {}
        for name in AGENTS:
            one = act(controller, observations[name], state, begins=begins, is_greedy=is_greedy, seed=seed)
            chosen[name], state = one
        return chosen, state
    if CHOICE in observations:
        return int(observations[CHOICE]), state
    if ENTRY not in observations:
        raise InputError(f"these observations hold {', '.join(map(str, observations))}, and no features: {_WRAP}")
    features, is_one = _features(controller, observations[ENTRY])
    envs = np.arange(len(features))
    if state is None:
        require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
        policy = controller.learner.policy(len(envs), seed=seed)
    elif state.space is not controller.learner.space:  # it would act with that agent's weights
        raise InputError("the state comes from another agent, or was pickled without its own; the first one is None")
    elif state.num_envs != len(envs):
        raise InputError(f"the state has {state.num_envs} environments, but the observations have {len(envs)}")
    else:
        flags, n = np.asarray(begins), len(envs)
        if flags.dtype != bool or flags.shape not in ((), (n,)):
            raise InputError(f"begins must be True, False or {n} of them, not {flags.dtype} of shape {flags.shape}")
        policy = state.next(np.broadcast_to(flags, n))
    masks = _masks(observations.get("action_mask"), len(envs), controller.learner.space.n_masked)
    drawn = (policy.act_greedily if is_greedy else policy.act)(envs, features, masks)
    actions = controller.features.actions.of_policy(drawn)
    return (actions if not is_one else int(actions[0]) if actions.ndim == 1 else actions[0]), policy


def _features(controller: PPOAgent, given: Any) -> tuple[NDArray[np.uint8], bool]:
    """Return features as [N, K] uint8, and whether they were given as [K], for one environment."""
    features, n_numbers = np.asarray(given), controller.learner.space.n_features
    if features.ndim not in (1, 2) or features.shape[-1] != n_numbers or features.dtype.kind not in "iu":
        found = f"{features.dtype} of shape {features.shape}"
        raise InputError(f"the agent reads {n_numbers} whole numbers of each environment, not {found}: {_WRAP}")
    as_bytes = features.astype(np.uint8)
    if not (as_bytes == features).all():
        raise InputError(f"features are numbers from 0 to 255, not from {features.min()} to {features.max()}")
    return as_bytes.reshape(-1, n_numbers), features.ndim == 1


def _masks(given: Any, n: int, n_actions: int) -> NDArray[np.bool_]:
    if given is None:
        return np.ones((n, n_actions), bool)
    masks = np.atleast_2d(given)
    if masks.dtype.kind not in "biu":
        raise InputError(f"an action mask must be bool or whole numbers, not {masks.dtype}")
    return masks.astype(bool)


class TrainedGoals:
    """A `MetaController` that chooses goals with a trained policy and does not learn.

    Its ``seed`` and the seeds of the environments determine its random choices.
    """

    def __init__(self, trained: PPOAgent, num_envs: int, seed: int) -> None:
        if memories := trained.features.memories:
            raise InputError(
                f"this meta-controller reads what only levels of its own run remember ({', '.join(memories)}): "
                "it plays in the environments of TrainedAgent.turns alone"
            )
        self._trained, self._num_envs = trained, num_envs
        self._policy = trained.learner.policy(num_envs, seed=seed)
        self._shift = np.random.default_rng(seed).random()

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Sample a goal for each of M environments, as in training.

        It depends on this object's seed and on the environment's seed, episode and turn, not on the batch.
        """
        uniforms = (situation.uniforms[:, 0] + self._shift) % 1.0
        features = self._trained.features.encode(situation)
        return self._policy.act(situation.envs, features, situation.masks, uniforms)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """Reset the recurrent states of environments [M]."""
        if envs.max(initial=0) >= self._num_envs:
            made_for = f"this meta-controller was made for {self._num_envs} environments"
            raise InputError(f"{made_for}, not for environment {envs.max()}; use meta_controller(num_envs=...)")
        self._policy.reset(envs)

    def for_play(self, num_envs: int, *, seed: int) -> TrainedGoals:
        """Return the same meta-controller for other environments."""
        return TrainedGoals(self._trained, num_envs, seed)
