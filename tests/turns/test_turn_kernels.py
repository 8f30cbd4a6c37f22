"""The compiled turns, compared with their slow twins in plain Python."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ledger_twin import LedgerTwin, legal_goals
from turns_helpers import make, record

from hierroom.turns.ledger import Ledger
from hierroom.turns.records import LEDGER, STEP
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS
from hierroom.worlds.escape_room.layout import OUTCOME
from hierroom.worlds.escape_room.oracle import shortest_actions


def as_dict(ledger):
    return {name: ledger.records[name].copy() for name in LEDGER.names}


def outcomes_of(rng, n):
    outcomes = np.zeros(n, OUTCOME)
    outcomes["achieved"] = np.where(rng.random(n) < 0.5, 0, rng.integers(1 << 13, size=n))  # several at a time, too
    outcomes["n_first"] = rng.integers(3, size=n)
    outcomes["reward"] = rng.choice([0, 0.25, 1, 0.1], n)
    outcomes["length"] = rng.integers(50, size=n)
    for name in ("is_novel", "is_discovery", "terminated", "truncated"):
        outcomes[name] = rng.random(n) < 0.2
    return outcomes


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 9),
    horizon=st.sampled_from([1, 3, np.iinfo(np.int64).max]),
    ends_with_option=st.booleans(),
    autoreset=st.booleans(),
)
@settings(max_examples=40)
def test_ledger_equals_its_plain_twin(seed, n, horizon, ends_with_option, autoreset):
    rng = np.random.default_rng(seed)
    ledger, twin = Ledger.at_reset(n, n_actions=5), LedgerTwin(n, n_actions=5)
    rules = {"return_ends_with_option": ends_with_option, "subgoal_horizon": horizon, "autoreset": autoreset}
    for _ in range(25):
        is_turn = ledger.is_meta_turn.copy() & (rng.random(n) < 0.8)
        goals = rng.integers(-1, 13, size=n)
        ledger.begin_options(np.flatnonzero(is_turn), goals[is_turn])
        twin.values["goals"][is_turn], twin.values["is_meta_turn"][is_turn] = goals[is_turn], False
        twin.values["meta_turns"] += is_turn
        actions, outcomes = rng.integers(-2, 8, size=n), outcomes_of(rng, n)
        records, n_ended = record(ledger, actions, outcomes, **rules)
        expected = twin.record(actions, outcomes, **rules)
        assert {*expected, "rewards"} == {*(STEP.names or ())}
        for name, values in expected.items():
            np.testing.assert_array_equal(records[name], values, err_msg=name, strict=True)
        assert n_ended == expected["episode_ended"].sum()
        assert not records["rewards"].any()
        assert ledger.is_any_turn() == ledger.is_meta_turn.any()
        for name, values in as_dict(ledger).items():
            np.testing.assert_array_equal(values, twin.values[name], err_msg=name, strict=True)


@pytest.mark.parametrize("mask", GOAL_MASKS)
def test_goals_are_legal_and_chosen_as_in_plain_python(mask):
    n, rng = 6, np.random.default_rng(3)
    for graph in "adg":
        turns = make(graph, n=n, goal_mask=mask, max_steps=60, subgoal_horizon=5)
        twin, seen = LedgerTwin(n, 5), set()
        for t in range(120):
            everywhere = np.arange(n)
            situation = turns.situation(everywhere)
            expected = legal_goals(situation, mask)
            np.testing.assert_array_equal(situation.goals_by(mask), expected)
            is_turn = turns.ledger.is_meta_turn.copy()
            masks = np.zeros((n, 14), bool)
            masks[:, :13] = expected & is_turn[:, None]
            masks[:, 13] = ~masks[:, :13].any(axis=1) | (mask == "seen")
            np.testing.assert_array_equal(situation.masks, masks)
            np.testing.assert_array_equal(turns.meta_masks(), masks)
            seen.update(map(tuple, masks.tolist()))
            actions = rng.integers(-3, 16, size=n)
            twin.values = as_dict(turns.ledger)
            twin.choose(masks, actions)
            before = turns.get_state()
            turns.choose(situation, actions)
            by_situation = as_dict(turns.ledger)
            turns.set_state(before)
            turns.choose_everywhere(actions)
            assert turns.ledger.is_any_turn() == turns.ledger.is_meta_turn.any()
            for name, values in as_dict(turns.ledger).items():
                np.testing.assert_array_equal(values, twin.values[name], err_msg=name)
                np.testing.assert_array_equal(values, by_situation[name], err_msg=name)
            actions = rng.integers(5, size=n)
            actions[t % n] = shortest_actions(turns.world.get_state([t % n]))[0]
            for _ in range(2):
                turns.step(actions)
        assert len(seen) > 1


@pytest.mark.parametrize("mask", GOAL_MASKS)
@pytest.mark.parametrize("graph", ["a", "c", "g"])
def test_legal_goals_near_the_exit_equal_the_twins(mask, graph):
    """Follow the shortest path, as no random walk gets so far: it opens inner doors and the exit's door."""
    turns, seen = make(graph, n=1, goal_mask=mask), []
    for action in shortest_actions(turns.world.get_state([0])):
        turns.ledger.write_fields({"is_meta_turn": True})
        expected = legal_goals(turns.situation(np.arange(1)), mask)
        np.testing.assert_array_equal(turns.meta_masks()[:, :13], expected)
        seen.append(bool(expected[0, 12]))
        turns.step(np.array([action]))
    assert seen[-1]
    assert seen[0] == (mask in ("existing", "none"))
