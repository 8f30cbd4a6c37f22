"""Kernels of a simple world: they write the results of a step into its outcomes, and begin episodes."""

import numpy as np

from hierroom.support.kernel import njit


@njit(cache=True, nogil=True)
def write_outcomes(
    times, rewards, terminated, truncated, counts, lengths, has_ended, outcomes, max_steps, target, autoreset
):
    """Write the outcomes [N] and update the counts; skip environments where the episode had already ended.

    Args:
        times: [N, G] int64, how often the step achieved each goal; set to 0 in skipped environments.
        rewards: [N] float64.
        terminated: [N] bool, where the step ended the episode.
        truncated: [N] bool, where something other than the step limit cut the episode off.
        counts: [N, G] int64, how often each goal was achieved in the episode, updated.
        lengths: [N] int64, steps of the episode, updated.
        has_ended: [N] bool, updated without ``autoreset``.
        outcomes: [N] records with the fields of `world.OUTCOME_FIELDS`.
        max_steps: steps after which an episode is truncated.
        target: the goal that ends an episode; a number that no goal has ends none.
        autoreset: whether the next episode begins where one ended.

    Returns:
        The number of achieved goals and the number of ended episodes.
    """
    n_achieved, n_ended = 0, 0
    for n in range(outcomes.shape[0]):
        outcome = outcomes[n]
        outcome.achieved, outcome.n_first, outcome.reward, outcome.elapsed = 0, 0, 0.0, 0
        if has_ended[n]:
            times[n] = 0
            continue
        lengths[n] += 1
        for goal in range(times.shape[1]):
            if times[n, goal] > 0:
                n_achieved += 1
                outcome.achieved |= np.int64(1) << goal
                outcome.n_first += counts[n, goal] == 0
                counts[n, goal] += times[n, goal]
        outcome.reward, outcome.length = rewards[n], lengths[n]
        outcome.terminated = terminated[n] or outcome.achieved >> target & 1 == 1
        outcome.truncated = not outcome.terminated and (truncated[n] or lengths[n] >= max_steps)
        if outcome.terminated or outcome.truncated:
            n_ended += 1
            has_ended[n] = not autoreset
    return n_achieved, n_ended


@njit(cache=True, nogil=True)
def begin_episodes(envs, episodes, counts, lengths, has_ended, markings, start):
    """Count the next episodes of environments [M] in ``episodes`` [N, 3], and clear what is known of the last ones.

    The other arrays are those of `write_outcomes`, and ``markings`` [N, F] int64, which become ``start`` [F].
    """
    for m in range(envs.shape[0]):
        n = envs[m]
        episodes[n, 2] += 1
        counts[n], lengths[n], has_ended[n] = 0, 0, False
        for fact in range(start.shape[0]):
            markings[n, fact] = start[fact]


@njit(cache=True, nogil=True)
def count_gains(before, after, begins, times):
    """Write by how much the totals of each goal grew, [N, G] int64, 0 where an episode ``begins`` [N]; update them."""
    for n in range(times.shape[0]):
        for goal in range(times.shape[1]):
            times[n, goal] = 0 if begins[n] else max(after[n, goal] - before[n, goal], 0)
            before[n, goal] = after[n, goal]
