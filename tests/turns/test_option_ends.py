"""The ends of options and returns, and the goal achieved instead of the one pursued."""

import numpy as np
import pytest
from turns_helpers import bits, record

from hierroom.goals import N_GOALS
from hierroom.turns.ledger import Ledger
from hierroom.turns.records import Step
from hierroom.turns.rewards import REWARDS, make_reward
from hierroom.worlds.escape_room.layout import OUTCOME

# event, terminated, truncated, the horizon runs out | return terminated, truncated: of intrinsic rewards, of others
RETURNS = [
    (-1, False, False, False, (False, False), (False, False)),
    (2, False, False, False, (True, False), (False, False)),
    (-1, False, False, True, (False, True), (False, False)),
    (2, False, False, True, (True, False), (False, False)),
    (3, False, False, True, (False, True), (False, False)),
    (12, True, False, False, (True, False), (True, False)),
    (12, True, True, False, (True, False), (True, False)),
    (-1, False, True, False, (False, True), (False, True)),
    (-1, False, True, True, (False, True), (False, True)),
    (2, False, True, False, (True, False), (False, True)),
]


@pytest.mark.parametrize("reward_name", REWARDS)
def test_controllers_return_ends_with_episode_or_option(reward_name):
    """All environments pursue goal 2; only a return of intrinsic rewards ends with the option."""
    n = len(RETURNS)
    ledger, outcomes = Ledger.at_reset(n, n_actions=5), np.zeros(n, OUTCOME)
    ledger.begin_options(np.arange(n), np.full(n, 2))
    events, outcomes["terminated"], outcomes["truncated"], late, intrinsic, others = zip(*RETURNS, strict=True)
    outcomes["achieved"] = bits(events)
    ledger.write_fields({"option_steps": np.where(late, 3, 0)})
    records, _ = record(
        ledger,
        np.zeros(n, np.int64),
        outcomes,
        return_ends_with_option=make_reward(reward_name).ends_with_option,
        subgoal_horizon=4,
    )
    step = Step(records, N_GOALS)
    ends = list(zip(step.return_terminated.tolist(), step.return_truncated.tolist(), strict=True))
    assert ends == list(intrinsic if reward_name == "intrinsic" else others)


def test_beginning_an_option_uses_up_the_meta_turn():
    ledger = Ledger.at_reset(3, n_actions=5)
    assert ledger.is_meta_turn.all()
    ledger.begin_options(np.array([0, 2]), np.array([4, -1]))
    assert ledger.meta_turns.tolist() == [1, 0, 1]
    assert ledger.is_meta_turn.tolist() == [False, True, False]
    assert ledger.goals.tolist() == [4, -1, -1]


def test_achieved_instead_is_the_first_event_of_an_option():
    ledger = Ledger.at_reset(1, n_actions=5)
    for goal, events, end, expected in [
        (2, [-1, 8, 3, -1], "", 8),  # its horizon of 4 steps runs out
        (2, [-1, -1, -1, -1], "", -1),
        (2, [8, 2], "", -1),  # its goal is reached
        (-1, [4], "", -1),
        (5, [12], "terminated", 12),
        (5, [-1, 6, -1], "truncated", 6),
        (5, [-1], "truncated", -1),  # the event of the previous option does not count
    ]:
        ledger.begin_options(np.array([0]), np.array([goal]))
        for t, event in enumerate(events, start=1):
            outcomes = np.zeros(1, OUTCOME)
            outcomes["achieved"], outcomes["n_first"] = bits(event), event >= 0
            if end and t == len(events):
                outcomes[end] = True
            records, _ = record(
                ledger, np.zeros(1, np.int64), outcomes, return_ends_with_option=False, subgoal_horizon=4
            )
            step = Step(records, N_GOALS)
            assert step.option_ended[0] == (t == len(events))
            assert step.achieved_instead[0] == (expected if t == len(events) else -1)
