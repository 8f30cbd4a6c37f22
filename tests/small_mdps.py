"""Deterministic MDPs with measures worked out by hand, and GORP played out rollout by rollout."""

import numpy as np

from benchmarks.measures.mdp import DeterministicMDP


def lock(n, n_actions=2):
    """A combination lock: action 1 leads on, the n-th time to the reward; any other one leads to a dead end."""
    transitions = np.full((n + 2, n_actions), n + 1)
    transitions[:n, 1] = np.arange(1, n + 1)
    transitions[n] = n
    rewards = np.zeros((n + 2, n_actions))
    rewards[n - 1, 1] = 1
    return DeterministicMDP(transitions, rewards)


def random_mdp(seed, n_states=6, n_actions=3):
    """Random moves among the states; one of them earns the reward and ends the episode."""
    rng = np.random.default_rng(seed)
    transitions = rng.integers(n_states, size=(n_states, n_actions))
    transitions[-1] = n_states - 1
    rewards = (transitions == n_states - 1) & (np.arange(n_states) != n_states - 1)[:, None]
    return DeterministicMDP(transitions, rewards.astype(float))


def play_gorp(mdp, horizon, k, m, rng):
    state, earned = mdp.start, 0.0
    for t in range(horizon):
        estimates = []
        for sequence in np.ndindex((mdp.n_actions,) * k):
            total = 0.0
            for _ in range(m):
                here = state
                for step in range(horizon - t):
                    action = sequence[step] if step < k else rng.integers(mdp.n_actions)
                    total += mdp.rewards[here, action]
                    here = mdp.transitions[here, action]
            estimates.append((total, sequence[0]))
        best = [max(total for total, first in estimates if first == action) for action in range(mdp.n_actions)]
        action = rng.choice(np.flatnonzero(np.array(best) == max(best)))
        earned += mdp.rewards[state, action]
        state = mdp.transitions[state, action]
    return earned


def slow_minimum_k(mdp, horizon, begin_with_rewards=False):
    """Definition 5.1 by recursion, in plain Python."""

    def greedy_fails(q_of, state, h):
        if h == 0:
            return False
        qs = [q_of(state, action, h) for action in range(mdp.n_actions)]
        bests = [best_q(state, action, h) for action in range(mdp.n_actions)]
        for action in range(mdp.n_actions):
            is_greedy, is_optimal = qs[action] >= max(qs) - 1e-12, bests[action] >= max(bests) - 1e-9
            if is_greedy and (not is_optimal or greedy_fails(q_of, mdp.transitions[state, action], h - 1)):
                return True
        return False

    def best_q(state, action, h):
        return mdp.rewards[state, action] + best(mdp.transitions[state, action], h - 1)

    def best(state, h):
        return max(best_q(state, action, h) for action in range(mdp.n_actions)) if h else 0.0

    def mean(state, h):
        if not h or begin_with_rewards:
            return 0.0
        values = [mdp.rewards[state, a] + mean(mdp.transitions[state, a], h - 1) for a in range(mdp.n_actions)]
        return sum(values) / mdp.n_actions

    def q_of(k):
        def q(state, action, h):
            after = mdp.transitions[state, action]
            if h == 1:
                return mdp.rewards[state, action]
            if k == 1:
                return mdp.rewards[state, action] + mean(after, h - 1)
            return mdp.rewards[state, action] + max(q_of(k - 1)(after, a, h - 1) for a in range(mdp.n_actions))

        return q

    return next((k for k in range(1, horizon) if not greedy_fails(q_of(k), mdp.start, horizon)), horizon)
