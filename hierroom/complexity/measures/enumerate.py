"""Every state of a Gymnasium environment that can be reached, as a deterministic MDP."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete

from hierroom.complexity.measures.mdp import DeterministicMDP
from hierroom.support.errors import InputError


def enumerate_env(
    env: gymnasium.Env,
    state: Callable[[Any], Hashable],
    *,
    actions: Sequence[int] | None = None,
    reward: Callable[[float], float] = float,
    seed: int = 0,
    max_states: int = 100_000,
) -> DeterministicMDP:
    """Walk through all states that can be reached after ``env.reset(seed=seed)``, by copies of the environment.

    States are numbered as they are found, the start being 0; terminal states become the last, absorbing one. Truncation
    is ignored, because the measures have a horizon.

    Args:
        env: a deterministic environment with discrete actions that `copy.deepcopy` can copy.
        state: returns what decides all that follows in an environment, without the number of steps.
        actions: which actions to take; all by default.
        reward: returns the MDP's reward for the environment's, such as ``lambda r: float(r > 0)`` where it shrinks with
            the number of steps.
        seed: seed of the level.
        max_states: largest number of states.
    """
    if not isinstance(env.action_space, Discrete):
        raise InputError(f"states are enumerated with discrete actions, not with {env.action_space}")
    first = int(env.action_space.start)
    chosen = range(first, first + int(env.action_space.n)) if actions is None else actions
    env.reset(seed=seed)
    numbers = {state(env): 0}
    frontier, transitions, rewards = [env], [], []
    while frontier:
        found = []
        for here in frontier:
            targets, earned = [], []
            for action in chosen:
                after = deepcopy(here)
                _, gained, terminated, _, _ = after.step(action)
                earned.append(reward(float(gained)))
                if terminated:
                    targets.append(-1)
                    continue
                key = state(after)
                if key not in numbers:
                    if len(numbers) >= max_states:
                        raise InputError(f"the environment has more than {max_states:,} states, which is the limit")
                    numbers[key] = len(numbers)
                    found.append(after)
                targets.append(numbers[key])
            transitions.append(targets)
            rewards.append(earned)
        frontier = found
    end = len(transitions)
    table = np.array([*transitions, [end] * len(chosen)])
    return DeterministicMDP(np.where(table < 0, end, table), np.array([*rewards, [0.0] * len(chosen)]))
