"""Options and rewards, counted by hand."""

import numpy as np
import pytest
from turns_helpers import bits, make, record, well_or_wildly

import hierroom
from hierroom.goals import EXIT_GOAL, N_GOALS, GoalGraph
from hierroom.meta import make_meta, take_turn
from hierroom.turns.ledger import Ledger
from hierroom.turns.records import META, OTHER, REACHED, STEP, TIMED_OUT, Step
from hierroom.turns.rewards import REWARDS, make_reward
from hierroom.worlds.env_config import NOVELTY_BONUS
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import OUTCOME
from hierroom.worlds.escape_room.oracle import shortest_actions

BOTH = ("meta_0", "controller_0")


# goal chosen | event | reward, end | extrinsic, bonus, intrinsic | reached, timed out, ended | meta reward, elapsed
STORY = [
    (2, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, 8, 0.25, "", 0.25, 1, 0, False, False, False, 0.00, 2),  # another goal than the one pursued
    (None, 2, 0.50, "", 0.50, 1, 1, True, False, True, 0.75, 3),
    (8, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 2),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 3),
    (None, -1, 0.00, "", 0.00, 0, 0, False, True, True, 0.00, 4),  # the horizon of 4 steps runs out
    (-1, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, 3, 0.00, "", 0.00, 1, 1, True, False, True, 0.00, 2),  # something new reaches 'no goal'
    (4, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 2),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 3),
    (None, 4, 0.00, "", 0.00, 1, 1, True, False, True, 0.00, 4),  # reached on its very last step
    (5, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, 12, 1.00, "terminated", 1.00, 1, 0, False, False, True, 1.00, 2),
]
TRUNCATED_AS_ITS_HORIZON_RUNS_OUT = [
    (6, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 1),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 2),
    (None, -1, 0.00, "", 0.00, 0, 0, False, False, False, 0.00, 3),
    (None, -1, 0.00, "truncated", 0.00, 0, 0, False, False, True, 0.00, 4),
]
ENDINGS = [
    (12, 12, 1.00, "terminated", 1.00, 1, 1, True, False, True, 1.00, 1),
    (6, -1, 0.00, "truncated", 0.00, 0, 0, False, False, True, 0.00, 1),
    (6, 6, 0.00, "truncated", 0.00, 1, 1, True, False, True, 0.00, 1),
    (-1, 12, 1.00, "terminated", 1.00, 1, 1, True, False, True, 1.00, 1),
]


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("story", [STORY, TRUNCATED_AS_ITS_HORIZON_RUNS_OUT, *[[ending] for ending in ENDINGS]])
@pytest.mark.parametrize("reward_name", REWARDS)
def test_options_pay_and_end_as_worked_by_hand(story, reward_name, place):
    """Play in one of three environments; the others pursue no goal and nothing happens in them."""
    ledger = Ledger.at_reset(3, n_actions=5)
    others = np.setdiff1d(np.arange(3), place)
    ledger.begin_options(others, np.full(2, -1))
    meta_rewards = 0
    for goal, event, reward, end, extrinsic, bonus, intrinsic, reached, late, ended, meta_reward, elapsed in story:
        assert ledger.is_meta_turn[place] == (goal is not None)
        if goal is not None:
            ledger.begin_options(np.array([place]), np.array([goal]))
        outcomes = np.zeros(3, OUTCOME)
        outcomes["achieved"][place], outcomes["n_first"][place] = bits(event), event >= 0
        outcomes["reward"][place] = reward
        if end:
            outcomes[place][end] = True
        rule = make_reward(reward_name)
        records, _ = record(
            ledger,
            np.zeros(3, np.int64),
            outcomes,
            return_ends_with_option=rule.ends_with_option,
            subgoal_horizon=4,
            weights=rule.weights,
        )
        step = Step(records, N_GOALS)
        expected = {"extrinsic": extrinsic, "bonus": bonus, "intrinsic": intrinsic, "novelty": extrinsic}[reward_name]
        assert (step.rewards[place], step.extrinsic[place]) == (expected, extrinsic)
        assert (step.reached[place], step.timed_out[place], step.option_ended[place]) == (reached, late, ended)
        assert (step.meta_rewards[place], step.meta_elapsed[place]) == (meta_reward, elapsed)
        assert step.episode_ended[place] == bool(end)
        if ended:
            assert (
                step.outcomes[place] == ledger.last_outcomes[place] == [OTHER, TIMED_OUT, REACHED][2 * reached + late]
            )
            assert ledger.goals[place] == -1
        assert not step.rewards[others].any()
        assert not step.meta_rewards[others].any()
        meta_rewards += meta_reward
    assert meta_rewards == sum(line[4] for line in story)


def test_bonus_is_paid_once_for_each_key():
    turns = make(drop_key=True, reward="bonus")
    key = int(turns.world.state.levels[0].colours[0])
    fetch = shortest_actions(turns.world.get_state(), key)
    rewards = [turns.step([action]).rewards[0] for action in fetch]
    assert rewards == [0.0] * (len(fetch) - 1) + [1.0]
    turns.step([5])
    again = turns.step([3])
    assert (again.events[0], again.rewards[0]) == (key, 0.0)


@pytest.mark.parametrize("reward_name", REWARDS)
@pytest.mark.parametrize("horizon", [None, 9])
def test_rewards_are_conserved(reward_name, horizon):
    """Over an episode, ``last``, the parallel environment and a count by the test give each agent the same rewards."""
    settings = {"graph": "b", "size": 11, "max_steps": 150, "subgoal_horizon": horizon, "drop_key": True}
    settings["reward"] = reward_name
    aec, parallel = hierroom.env(**settings), hierroom.parallel_env(**settings)
    world = Engine([GoalGraph.named("b")], size=11, max_steps=150, drop_key=True, memories=["visited"])
    rng = np.random.default_rng(1)
    successes = 0
    for seed in range(12):
        aec.reset(seed=seed)
        parallel.reset(seed=seed)
        world.reset(seed)
        from_last, from_parallel, by_hand = (dict.fromkeys(BOTH, 0.0) for _ in range(3))
        seen_before, goal, choice = set(), -1, 13
        for agent in aec.agent_iter():
            observation, reward, terminated, truncated, _ = aec.last()
            from_last[agent] += reward
            if terminated or truncated:
                aec.step(None)
            elif agent == "meta_0":
                choice = int(rng.choice(np.flatnonzero(observation["action_mask"])))
                goal = choice if choice < N_GOALS else -1
                aec.step(choice)
            else:
                action = well_or_wildly(rng, world)
                aec.step(action)
                for name, given in parallel.step({"meta_0": choice, "controller_0": action})[1].items():
                    from_parallel[name] += given
                outcome = world.step_within_episode(np.array([action]))[0]
                event = int(outcome["achieved"]).bit_length() - 1
                by_hand["meta_0"] += event == EXIT_GOAL
                by_hand["controller_0"] += {
                    "extrinsic": event == EXIT_GOAL,
                    "bonus": event >= 0 and event not in seen_before,
                    "intrinsic": event >= 0 and event == goal,
                    "novelty": (event == EXIT_GOAL) + NOVELTY_BONUS * float(outcome["is_novel"]),
                }[reward_name]
                seen_before.add(event)
                successes += bool(outcome["terminated"])
        assert from_last == from_parallel == by_hand
    assert successes > 0


def test_option_rewards_add_up_to_step_rewards():
    turns, meta = make(n=32, seed=2, max_steps=60, subgoal_horizon=5, reward="extrinsic"), make_meta("fixed-dfs")
    rng = np.random.default_rng(0)
    of_options, of_steps, elapsed = np.zeros(32), np.zeros(32), np.zeros(32, np.int64)
    for t in range(1, 401):
        take_turn(meta, turns)
        step = turns.step([well_or_wildly(rng, turns.world) if n == 0 else rng.integers(5) for n in range(32)])
        of_options += step.meta_rewards
        of_steps += step.rewards
        elapsed += np.where(step.option_ended, step.meta_elapsed, 0)
        np.testing.assert_array_equal(of_options[step.option_ended], of_steps[step.option_ended])
        np.testing.assert_array_equal(elapsed[step.option_ended], t)
        assert (step.meta_elapsed <= 5).all()
    assert of_steps.sum() > 0


def test_terminated_option_is_not_also_truncated():
    steps = np.zeros(3, STEP)
    steps["option_ended"], steps["terminated"], steps["truncated"] = True, [True, False, True], [False, True, True]
    envs, _, _, terminated, truncated = Step(steps, N_GOALS).ended_turns(META)
    assert envs.tolist() == [0, 1, 2]
    assert terminated.tolist() == [True, False, True]
    assert truncated.tolist() == [False, True, False]
