"""User-defined meta-controllers and plain functions in play: their choices, and the steps that they are shown."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from turns_helpers import make

from hierroom import InputError
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.gym_env import EscapeRoom
from hierroom.meta import make_meta, take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import META
from hierroom.vector_env import EscapeRooms


@pytest.mark.parametrize(
    ("said", "what"),
    [
        (np.zeros(2, np.int64), "an array of int64 and shape (2,)"),
        (np.zeros(3), "an array of float64 and shape (3,)"),
        (0, "an array of int64 and shape ()"),
        (None, "an array of object and shape ()"),
        ([[0], [0, 1], [0]], "an array of object and shape ()"),
        (["red key"] * 3, "an array of <U7 and shape (3,)"),
    ],
)
def test_an_invalid_choice_raises_input_error(said, what):
    wanted = "3 goal ids (whole numbers, one for each environment that asks)"
    with pytest.raises(InputError, match=f"meta-controller's choice must be {re.escape(f'{wanted}, not {what}')}$"):
        take_turn(SimpleNamespace(choose=lambda *_: said), make("a", 3))


class Diary:
    def __init__(self):
        self.begun, self.asked = [], []

    def reset(self, envs):
        self.begun.append(envs.tolist())

    def choose(self, observations, legal, situation):
        self.asked.append(situation.envs.tolist())
        assert {len(values) for values in observations.values()} == {len(situation)} == {len(legal)}
        assert legal.shape == (len(situation), 13)
        assert observations["action_mask"][:, :13].astype(bool).tolist() == legal.tolist()
        return legal.argmax(axis=1)


def test_meta_controller_chooses_per_option_and_resets_per_episode():
    turns, diary = make("a", 3, max_steps=10, subgoal_horizon=4), Diary()
    turns.world._state.levels["steps"] = [0, 0, 6]
    for _ in range(11):
        take_turn(diary, turns)
        turns.step([1, 1, 1])
    take_turn(diary, turns)
    # Environments 0 and 1 end after 10 steps; environment 2 after 4, just as its option does, and again after 14.
    assert diary.begun == [[0, 1, 2], [2], [0, 1]]
    assert diary.asked == [[0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 1]]


def nearest_by_hand(turns):
    """Rows plus columns from the agents to the keys and doors; the nearest of the legal goals, or -1."""
    levels, situation = turns.world.state.levels, turns.situation(np.arange(len(turns)))
    places = situation.by_goal(
        *(levels["keys_at"] @ (100, 1), levels["doors_at"] @ (100, 1)), levels["exit_at"] @ (100, 1)
    )
    row, col = np.divmod(places, 100)
    distances = abs(row - levels["row"][:, None]) + abs(col - levels["col"][:, None])
    nearest = np.where(situation.legal, distances, 1000).argmin(axis=1)
    return np.where(situation.legal.any(axis=1), nearest, -1).tolist()


def nearest(level):
    return min(level.legal_goals, key=lambda goal: goal.distance)


@pytest.mark.parametrize("goal_mask", ["reachable", "seen"])  # under the second, some levels have no legal goal
@pytest.mark.parametrize("function", [nearest, lambda here: nearest(here).id, lambda here: np.int8(nearest(here).id)])
def test_plain_function_works_as_a_meta_controller(function, goal_mask):
    rng, meta, given = np.random.default_rng(0), make_meta(function), set()
    turns = make("e", 30, size=19, goal_mask=goal_mask, subgoal_horizon=5, max_steps=50)
    for _ in range(60):
        expected = np.where(turns.ledger.is_meta_turn, nearest_by_hand(turns), turns.goals)
        take_turn(meta, turns)
        assert turns.goals.tolist() == expected.tolist()
        given |= set(expected.tolist())
        turns.step(rng.choice([0, 0, 1, 2, 3, 4], size=30))
    assert len(given) > 8
    assert (-1 in given) == (goal_mask == "seen")
    assert not turns.ledger.illegal_goals.any()


@pytest.mark.parametrize("said", [None, -1, 13])
def test_a_plain_function_may_choose_no_goal(said):
    turns = make("a", 3, goal_mask="none")
    take_turn(make_meta(lambda level: said), turns)
    assert turns.goals.tolist() == [-1] * 3


@pytest.mark.parametrize("bad", [True, 99, -7, 1.0, "red key", [0], np.zeros(13), np.zeros((2, 2)), {"goal": 1}])
def test_an_invalid_choice_of_a_plain_function_raises_input_error(bad):
    def choose_badly(level):
        return bad

    for function in (choose_badly, lambda level: bad):
        said = f"{function.__name__} must return a goal of the level, a goal id (0 to 12) or None, not "
        with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
            take_turn(make_meta(function), make("a", 3))
        assert "\n" not in str(caught.value)


class Watcher:
    def __init__(self):
        self.seen = []

    def choose(self, observations, legal, situation):
        return legal.argmax(axis=1)

    def observe(self, step, turns):
        assert turns.last_step is step
        self.seen.append((step.actions.copy(), step.lengths.copy(), turns.world.state.levels["steps"].copy()))


def check_watched(seen, n_envs, n_steps):
    assert len(seen) == n_steps
    clocks = np.zeros(n_envs, int)
    for _, lengths, begun in seen:
        np.testing.assert_array_equal(lengths, clocks + 1)
        clocks = np.where(lengths == 9, 0, clocks + 1)  # episodes of 9 steps
        np.testing.assert_array_equal(begun, clocks)


@pytest.mark.slow
def test_observe_is_called_for_every_training_step():
    trainer = Trainer(TrainConfig(num_envs=4, steps=400).changed(size=11, max_steps=9, meta="random"))
    trainer.turns.reset(0)  # without the staggered clocks
    watcher = Watcher()
    trainer.agents[META] = ScriptedAgent(watcher, is_training=True)
    while not trainer.is_done:
        trainer.advance()
    check_watched(watcher.seen, 4, trainer.steps // 4)


def test_observe_is_called_for_every_gymnasium_step():
    one, many = Watcher(), Watcher()
    single = EscapeRoom("c", size=11, max_steps=9, meta=one)
    single.reset(seed=0)
    for _ in range(9):
        single.step(1)
    assert [lengths.item() for _, lengths, _ in one.seen] == list(range(1, 10))
    rooms = EscapeRooms(3, "c", size=11, max_steps=9, meta=many, autoreset_mode="SameStep")
    rooms.reset(seed=0)
    for _ in range(25):
        rooms.step(np.ones(3, int))
    check_watched(many.seen, 3, 25)
