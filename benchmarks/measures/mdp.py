"""A deterministic Markov decision process with finitely many states, and its values over a finite horizon.

Values [T + 1, S] are undiscounted (Laidlaw, Russell and Dragan, 2023). Row h is for h steps left; row 0 is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete
from numpy.typing import NDArray

from benchmarks.measures import horizon_kernels as kernels
from hierroom.complexity.augmented import AugmentedGraph
from hierroom.support.env_results import step_results
from hierroom.support.errors import InputError, require_number, shown, user_code

Values = NDArray[np.float64]
MAX_VALUES = 100_000_000
"""Largest number of entries (T + 1) * S of an array of values: 800 MB."""
MAX_REWARD = 1e100
"""Largest size of a reward; squares of returns must not overflow a float."""


@dataclass(frozen=True, eq=False)
class DeterministicMDP:
    """States 0..S - 1, actions 0..A - 1, and for each pair the next state and the reward.

    An episode ends in an absorbing state: every action stays there and earns nothing.

    Args:
        transitions: [S, A] int, the state after each action.
        rewards: [S, A] float, of at most 1e100 in size.
        start: the state in which every episode begins.
    """

    transitions: NDArray[np.int64]
    rewards: NDArray[np.float64]
    start: int = 0

    def __post_init__(self) -> None:
        try:
            transitions, rewards = np.asarray(self.transitions), np.array(self.rewards, float)
        except (TypeError, ValueError) as error:
            raise InputError(f"transitions and rewards of an MDP must be tables of numbers: {error}") from error
        if transitions.ndim != 2 or transitions.shape != rewards.shape or not transitions.size:
            raise InputError(
                "transitions and rewards of an MDP must both be of shape [states, actions], "
                f"not {transitions.shape} and {rewards.shape}"
            )
        n = len(transitions)
        if transitions.dtype.kind not in "iu" or transitions.min() < 0 or transitions.max() >= n:
            raise InputError(f"the next states of an MDP with {n} states must be whole numbers from 0 to {n - 1}")
        if not (np.abs(rewards) <= MAX_REWARD).all():
            raise InputError(f"the rewards of an MDP must be numbers of at most {MAX_REWARD:.0e} in size")
        require_number(f"the start of an MDP with {n} states", self.start, 0, n - 1, is_whole=True)
        object.__setattr__(self, "transitions", transitions.astype(np.int64))
        object.__setattr__(self, "rewards", rewards)

    @property
    def n_states(self) -> int:
        """Number of states S."""
        return len(self.transitions)

    @property
    def n_actions(self) -> int:
        """Number of actions A."""
        return self.transitions.shape[1]

    @cached_property
    def is_absorbing(self) -> NDArray[np.bool_]:
        """Flags [S] of states in which every action stays and earns nothing."""
        stays = self.transitions == np.arange(self.n_states)[:, None]
        return (stays & (self.rewards == 0)).all(axis=1)

    @cached_property
    def is_binary(self) -> bool:
        """Return whether every return is 0 or 1: the only reward is 1, and it ends the episode."""
        earns = self.rewards != 0
        return bool((self.rewards[earns] == 1).all() and self.is_absorbing[self.transitions[earns]].all())

    def random_values(self, horizon: int) -> Values:
        """Return the expected return of the uniformly random policy: [T + 1, S]."""
        values = self._zeros(horizon)
        kernels.random_values(self.transitions, self.rewards, values)
        return values

    def optimal_values(self, horizon: int) -> Values:
        """Return the greatest return: [T + 1, S]."""
        return self._greatest_values(self.rewards, horizon)

    def worst_values(self, horizon: int) -> Values:
        """Return the least return: [T + 1, S]."""
        return -self._greatest_values(-self.rewards, horizon)

    def optimal_actions(self, horizon: int) -> NDArray[np.bool_]:
        """Return whether each action earns the greatest return: [T + 1, S, A] bool; row 0 is False."""
        values = self.optimal_values(horizon)
        is_optimal = np.zeros((horizon + 1, *self.transitions.shape), bool)
        for h in range(1, horizon + 1):
            least = values[h] - kernels.TIE * np.abs(values[h])
            is_optimal[h] = self.rewards + values[h - 1][self.transitions] >= least[:, None]
        return is_optimal

    def random_success(self, horizon: int) -> float:
        """Return the random policy's chance of the best return: P_h(s) = sum_optimal P_{h-1}(s') / A, P_0 = 1."""
        is_optimal, success = self.optimal_actions(horizon), np.ones(self.n_states)
        for h in range(1, horizon + 1):
            success = (is_optimal[h] * success[self.transitions]).mean(axis=1)
        return float(success[self.start])

    def shortest_solution(self) -> int:
        """Return the fewest steps from the start until a reward above 0 is earned; -1 if none can be earned."""
        reached = np.zeros(self.n_states, bool)
        frontier, steps = np.array([self.start]), 0
        while frontier.size:
            steps += 1
            if (self.rewards[frontier] > 0).any():
                return steps
            reached[frontier] = True
            after = np.unique(self.transitions[frontier])
            frontier = after[~reached[after]]
        return -1

    def _greatest_values(self, rewards: NDArray[np.float64], horizon: int) -> Values:
        values = self._zeros(horizon)
        kernels.greatest_values(self.transitions, rewards, values, np.arange(1, horizon + 1))
        return values

    def _zeros(self, horizon: int) -> Values:
        check_horizon(self, horizon)
        return np.zeros((horizon + 1, self.n_states))


def check_horizon(mdp: DeterministicMDP, horizon: int) -> None:
    """Check that the horizon is a whole number of at least 1, and that arrays of values fit into `MAX_VALUES`."""
    require_number("the horizon of an MDP", horizon, 1, is_whole=True)
    if (horizon + 1) * mdp.n_states > MAX_VALUES:
        raise InputError(
            f"{mdp.n_states:,} states over a horizon of {shown(horizon)} have more than the {MAX_VALUES:,} values that "
            "can be held; choose a shorter horizon"
        )


def graph_mdp(augmented: AugmentedGraph) -> DeterministicMDP:
    """Return the MDP of an agent that chooses the next node of an augmented goal graph, without restarts.

    Action i takes the i-th edge of a node, in the order of `AugmentedGraph.edges`, or stays if there are fewer edges.
    The step to the exit earns 1 and ends the episode.

    Args:
        augmented: the augmented goal graph.
    """
    sources, targets = augmented.edges.T  # the edges of a node follow each other
    n = len(augmented.nodes)
    transitions = np.repeat(np.arange(n)[:, None], np.bincount(sources).max(), axis=1)
    transitions[sources, np.arange(len(sources)) - np.searchsorted(sources, sources)] = targets
    rewards = ((transitions == augmented.exit) & (np.arange(n) != augmented.exit)[:, None]).astype(float)
    return DeterministicMDP(transitions, rewards, augmented.start)


def enumerate_env(
    env: gymnasium.Env,
    state: Callable[[Any], Hashable],
    *,
    actions: Sequence[int] | None = None,
    reward: Callable[[float], float] = float,
    seed: int = 0,
    max_states: int = 100_000,
) -> DeterministicMDP:
    """Return the MDP of all states that can be reached after ``env.reset(seed=seed)``, found with copies of ``env``.

    States are numbered in the order in which they are found, from the start, 0. All terminal states become one
    absorbing state, the last. Truncation is ignored, because the measures have a horizon.

    Args:
        env: a deterministic environment with discrete actions that `copy.deepcopy` can copy.
        state: returns all that determines an environment's future, without the number of steps.
        actions: the actions to take; all by default.
        reward: converts a reward, such as ``lambda r: float(r > 0)`` if rewards shrink with the number of steps.
    """
    if not isinstance(env.action_space, Discrete):
        raise InputError(f"states are enumerated with discrete actions, not with {env.action_space}")
    first = int(env.action_space.start)
    chosen = range(first, first + int(env.action_space.n)) if actions is None else actions
    with user_code("the environment, or a function given with it,"):
        return _enumerated(env, state, chosen, reward, seed, max_states)


def _enumerated(
    env: gymnasium.Env,
    state: Callable[[Any], Hashable],
    chosen: Sequence[int],
    reward: Callable[[float], float],
    seed: int,
    max_states: int,
) -> DeterministicMDP:
    env.reset(seed=seed)
    numbers = {state(env): 0}
    frontier, transitions, rewards = [env], [], []
    while frontier:
        found = []
        for here in frontier:
            targets, earned = [], []
            for action in chosen:
                after = deepcopy(here)
                _, (gained,), (terminated,), *_ = step_results([after.step(action)], "the environment")
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
