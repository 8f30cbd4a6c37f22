"""Compiled kernels of the two agents' turns, on records of `records.LEDGER` and `records.STEP`.

Constants shared with the rest of the package are defined here, so that this module imports only the compiler. With
``NUMBA_DISABLE_JIT=1`` the same source runs as ordinary Python.
"""

import numpy as np

from hierroom.support.kernel import njit

NO_GOAL = -1
NO_OUTCOME, REACHED, TIMED_OUT, OTHER = range(4)
"""Outcomes of the last option: no option yet, goal reached, horizon ran out, or episode ended."""


@njit(cache=True, nogil=True)
def record_turns(outcomes, actions, ledgers, steps, starts, rules):
    """Take the controller's turn in every environment, and end the options that are over.

    Args:
        outcomes: [N] records with the fields of `world.OUTCOME_FIELDS`.
        actions: [N] int64, the controller's.
        ledgers: [N] records of `records.LEDGER`, updated in place.
        steps: [N] records of `records.STEP`, written.
        starts: [1] the record of `records.LEDGER` at the start of an episode.
        rules: [1] record of `records.RULES`; one record, because each further argument takes time.

    Returns:
        The numbers of environments in which the episode ended, and in which the meta-controller has a turn.
    """
    rule, n_ended, n_turns = rules[0], 0, 0
    return_ends_with_option, horizon, n_actions = rule.return_ends_with_option, rule.horizon, rule.n_actions
    autoreset, target = rule.autoreset, rule.target
    w_extrinsic, w_first, w_reached, w_novel = rule.extrinsic, rule.n_first, rule.reached, rule.is_novel
    for n in range(outcomes.shape[0]):
        outcome, ledger, step = outcomes[n], ledgers[n], steps[n]
        goal, achieved = ledger.goals, outcome.achieved
        elapsed = max(outcome.elapsed, 1)
        ledger.option_steps += elapsed
        ledger.option_rewards += outcome.reward
        action = actions[n]
        if action < 0 or action >= n_actions:
            action = n_actions
            ledger.illegal_actions += 1
        ledger.previous_actions = action
        terminated, truncated = outcome.terminated, outcome.truncated
        ended = terminated or truncated
        is_new = outcome.n_first > 0 or outcome.is_discovery
        reached = is_new if goal == NO_GOAL else achieved >> goal & 1 == 1
        event = NO_GOAL  # the pursued goal if it was reached, else the first achieved one
        if goal != NO_GOAL and reached:
            event = goal
        elif achieved:
            event = 0
            while not achieved >> event & 1:
                event += 1
        if ledger.first_events == NO_GOAL:
            ledger.first_events = event
        timed_out = ledger.option_steps >= horizon and not (reached or ended)
        option_ended = reached or timed_out or ended
        return_terminated = terminated or (return_ends_with_option and reached)
        return_truncated = truncated or (return_ends_with_option and timed_out)

        step.actions, step.goals, step.events, step.achieved_bits = action, goal, event, achieved
        step.n_first, step.is_discovery, step.is_novel = outcome.n_first, outcome.is_discovery, outcome.is_novel
        step.extrinsic = outcome.reward
        step.rewards = w_extrinsic * outcome.reward + w_first * outcome.n_first + w_reached * reached
        step.rewards += w_novel * outcome.is_novel
        step.reached, step.timed_out, step.option_ended, step.episode_ended = reached, timed_out, option_ended, ended
        step.meta_rewards = ledger.option_rewards if option_ended else 0.0
        step.elapsed, step.meta_elapsed = elapsed, ledger.option_steps
        step.achieved_instead = ledger.first_events if option_ended and not reached else NO_GOAL
        step.terminated, step.truncated = terminated, truncated
        step.success = terminated and achieved >> target & 1 == 1
        step.return_terminated = return_terminated
        step.return_truncated = return_truncated and not return_terminated
        step.lengths, step.shortest, step.illegal_actions = outcome.length, ledger.shortest, ledger.illegal_actions

        ledger.is_meta_turn = option_ended
        if option_ended:
            ledger.last_goals = goal
            ledger.last_outcomes = REACHED if reached else (TIMED_OUT if timed_out else OTHER)
            ledger.goals, ledger.first_events = NO_GOAL, NO_GOAL
            ledger.option_steps, ledger.option_rewards = 0, 0.0
        if ended:
            n_ended += 1
            if autoreset:
                ledgers[n] = starts[0]
            else:
                ledger.is_meta_turn = False
        n_turns += ledger.is_meta_turn
    return n_ended, n_turns


@njit(cache=True, nogil=True)
def take_goals(masks, ledgers, actions):
    """Take the meta-controller's turn wherever it has one.

    Args:
        masks: [N, G + 1] bool, the legal actions, 'no goal' the last.
        ledgers: [N] records of `records.LEDGER`, updated in place.
        actions: [N] int64 goal ids, or no goal (G or -1); illegal ones act as no goal and are counted.
    """
    no_goal_action = masks.shape[1] - 1
    for n in range(masks.shape[0]):
        ledger, action = ledgers[n], actions[n]
        if action == NO_GOAL:
            action = no_goal_action
        is_legal = 0 <= action <= no_goal_action and masks[n, np.uint64(action)]
        ledger.illegal_goals += not is_legal
        if ledger.is_meta_turn:
            ledger.goals = action if is_legal and action < no_goal_action else NO_GOAL
            ledger.meta_turns += 1
            ledger.is_meta_turn = False


@njit(cache=True, nogil=True)
def write_results(steps, ledgers, begins_anew, rewards, flags, numbers):
    """Write the rewards, ends and infos that a vector environment returns.

    Args:
        steps: [N] records of `records.STEP`.
        ledgers: [N] records of `records.LEDGER`, after the step.
        begins_anew: whether infos describe the next episode where one ended.
        rewards: [N] float64.
        flags: [9, N] bool: terminated, truncated, success, and the masks of six infos, which are all True.
        numbers: [5, N] int64: goal events, elapsed steps (0 after a reset), illegal actions, lengths, shortest lengths.
    """
    for n in range(steps.shape[0]):
        step, ledger = steps[n], ledgers[n]
        rewards[n], flags[0, n], flags[1, n] = step.rewards, step.terminated, step.truncated
        if begins_anew and step.episode_ended:
            flags[2, n], numbers[0, n], numbers[1, n], numbers[2, n], numbers[3, n] = False, NO_GOAL, 0, 0, 0
            numbers[4, n] = ledger.shortest
        else:
            flags[2, n], numbers[0, n], numbers[1, n] = step.success, step.events, step.elapsed
            numbers[2, n], numbers[3, n], numbers[4, n] = step.illegal_actions, step.lengths, step.shortest
    flags[3:] = True
