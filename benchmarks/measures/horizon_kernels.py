"""Value iteration over a finite horizon on a deterministic MDP, as compiled functions.

Arrays of values are [T + 1, S], with row h for h steps left and row 0 zero. Transitions and rewards are [S, A].
"""

import numpy as np
from numba import njit

TIE = 1e-9
"""Two values count as equal if they differ by less than this fraction of the greater one."""


@njit(cache=True)
def write_q(transitions, rewards, row, state, q):
    """Write Q of each action into ``q``, and return the greatest; ``row`` has the values with one step less to go."""
    top = -np.inf
    for action in range(transitions.shape[1]):
        q[action] = rewards[state, action] + row[np.uint64(transitions[state, action])]
        if q[action] > top:
            top = q[action]
    return top


@njit(cache=True)
def random_values(transitions, rewards, values):
    """Write V_h(s) = mean over a of r(s, a) + V_(h-1)(s')."""
    q = np.empty(transitions.shape[1])
    for h in range(1, values.shape[0]):
        for state in range(transitions.shape[0]):
            write_q(transitions, rewards, values[h - 1], state, q)
            values[h, state] = q.mean()


@njit(cache=True)
def greatest_values(transitions, rewards, values, horizons):
    """Write V_h(s) = max over a of r(s, a) + V_(h-1)(s') for the ``horizons`` h, in their order.

    In ascending order this gives the optimal values. In descending order it extends each plan by one step.
    """
    q = np.empty(transitions.shape[1])
    for h in horizons:
        for state in range(transitions.shape[0]):
            values[h, state] = write_q(transitions, rewards, values[h - 1], state, q)


@njit(cache=True)
def look_ahead_variances(transitions, variances):
    """Replace each bound, in place, by the greatest bound after one action; bounds are not negative."""
    n_states, n_actions = transitions.shape
    for h in range(variances.shape[0] - 1, 0, -1):
        for state in range(n_states):
            greatest = 0.0
            for action in range(n_actions):
                greatest = max(greatest, variances[h - 1, transitions[state, action]])
            variances[h, state] = greatest


@njit(cache=True)
def greedy_is_optimal(transitions, rewards, values, is_optimal, start):
    """Return whether every policy that is greedy in Q takes only optimal actions, whatever it does at ties."""
    n_states, n_actions = transitions.shape
    q = np.empty(n_actions)
    visited, following = np.zeros(n_states, np.bool_), np.zeros(n_states, np.bool_)
    visited[start] = True
    for h in range(values.shape[0] - 1, 0, -1):
        following[:] = False
        for state in range(n_states):
            if not visited[state]:
                continue
            top = write_q(transitions, rewards, values[h - 1], state, q)
            least = top - TIE * abs(top)
            for action in range(n_actions):
                if q[action] >= least:
                    if not is_optimal[h, state, action]:
                        return False
                    following[transitions[state, action]] = True
        visited, following = following, visited
    return True


@njit(cache=True)
def greatest_ratio(transitions, rewards, values, variances, is_optimal, start):
    """Return the greatest variance / gap^2 of the states that may be visited.

    Return -1 if a greedy action may be suboptimal, or if a gap is so small that the ratio overflows a float.
    """
    n_states, n_actions = transitions.shape
    q = np.empty(n_actions)
    visited, following = np.zeros(n_states, np.bool_), np.zeros(n_states, np.bool_)
    visited[start] = True
    greatest = 0.0
    for h in range(values.shape[0] - 1, 0, -1):
        following[:] = False
        for state in range(n_states):
            if not visited[state]:
                continue
            top, best_suboptimal = write_q(transitions, rewards, values[h - 1], state, q), -np.inf
            for action in range(n_actions):
                if not is_optimal[h, state, action] and q[action] > best_suboptimal:
                    best_suboptimal = q[action]
            gap = top - best_suboptimal
            squared = gap**2
            if gap <= TIE * abs(top) or squared == 0.0:
                return -1.0
            greatest = max(greatest, variances[h, state] / squared)
            for action in range(n_actions):
                if q[action] > best_suboptimal:
                    following[transitions[state, action]] = True
        visited, following = following, visited
    return greatest if greatest < np.inf else -1.0
