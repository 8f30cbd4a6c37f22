"""User-defined rewards: the steps they get, how they are named, and errors for invalid ones."""

import sys

import numpy as np
import pytest
from turns_helpers import make

import hierroom
from hierroom.agents.player import OraclePlayer
from hierroom.goals import EXIT_GOAL
from hierroom.meta import make_meta, take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.turns.records import Step
from hierroom.turns.rewards import REWARDS, make_reward
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import MEMORIES
from hierroom.worlds.escape_room.level import Level

SETTINGS = {"graph": "c", "size": 11, "max_steps": 40, "subgoal_horizon": 7, "drop_key": True}


class Watching:
    def __init__(self):
        self.steps: list[Step] = []

    def rewards(self, step):
        assert not step.rewards.any()
        self.steps.append(step)
        return np.zeros(len(step.goals))


def play(turns: Turns, n_steps: int, seed: int = 0) -> list[Step]:
    meta, rng = make_meta("random"), np.random.default_rng(seed)
    steps = []
    for _ in range(n_steps):
        take_turn(meta, turns)
        steps.append(turns.step(rng.integers(turns.world.n_actions, size=len(turns))))
    return steps


def test_step_has_the_states_before_and_after_it():
    reward = Watching()
    turns = make(n=6, reward=reward, **SETTINGS)
    slow = Engine([hierroom.GoalGraph.named("c")], 6, size=11, max_steps=40, drop_key=True, seed=0, memories=MEMORIES)
    play(turns, 100)
    ends = 0
    for step in reward.steps:
        for name in ("grids", "levels"):
            np.testing.assert_array_equal(getattr(step.before, name), getattr(slow.state, name), err_msg=name)
        before = slow.get_state()
        slow.step_within_episode(step.actions)
        for name in ("grids", "levels"):
            np.testing.assert_array_equal(getattr(step.after, name), getattr(slow.state, name), err_msg=name)
        ended = np.flatnonzero(step.episode_ended)
        ends += len(ended)
        if len(ended):  # repeat the step with its reset
            slow.set_state(before)
            slow.step(step.actions)
    assert ends >= 12


@pytest.mark.parametrize("name", REWARDS)
def test_shipped_rewards_equal_the_same_rewards_as_user_code(name):
    class Own:
        def __init__(self):
            shipped = make_reward(name)
            self.ends_with_option, self.memories = shipped.ends_with_option, shipped.memories

        def rewards(self, step):
            return {
                "extrinsic": lambda: step.after.levels["has_ended"] & step.terminated,
                "bonus": lambda: step.is_first,
                "intrinsic": lambda: step.reached,
                "novelty": lambda: step.terminated + 0.25 * step.is_novel,
            }[name]()

    settings, oracle = SETTINGS | {"max_steps": 200, "novelty_bonus": 0.25}, OraclePlayer()
    one_turns, other_turns = make(n=5, reward=Own(), **settings), make(n=5, reward=name, **settings)
    own, shipped = play(one_turns, 60), play(other_turns, 60)
    for _ in range(100):
        own.append(oracle.step(one_turns))
        shipped.append(other_turns.step(own[-1].actions))
    for one, other in zip(own, shipped, strict=True):
        for field in ("rewards", "return_terminated", "return_truncated", "is_novel"):
            np.testing.assert_array_equal(getattr(one, field), getattr(other, field), err_msg=field)
    assert sum(step.rewards.sum() for step in own) > 0
    assert make_reward(name).ends_with_option == (name == "intrinsic")


def test_reading_is_novel_requires_the_visited_memory():
    def curious(step):
        return 2.0 * step.is_novel

    with pytest.raises(InputError, match=r'reads is_novel must have the attribute memories = \("visited",\)$'):
        play(make(n=3, reward=curious, **SETTINGS), 1)
    curious.memories = ("visited",)
    steps = play(make(n=3, reward=curious, **SETTINGS), 30)
    assert sum(step.rewards.sum() for step in steps) > 0
    for step in steps:
        np.testing.assert_array_equal(step.rewards, 2.0 * step.is_novel)


def test_steps_keep_states_only_if_needed():
    class Cheap(Watching):
        needs_states = False

    for reward, needs in ((Watching(), True), (Cheap(), False), ("intrinsic", False)):
        step = play(make(n=2, reward=reward, **SETTINGS), 1)[0]
        assert (step.before is not None) == (step.after is not None) == needs


def test_state_distances_equal_level_distances():
    turns = make("f", n=8, size=13)
    for _ in range(30):
        turns.step(np.random.default_rng(0).integers(5, size=8))
    state, everything = turns.world.get_state(), np.ones(13, bool)
    for goal in range(EXIT_GOAL + 1):
        distances = state.distances(np.full(8, goal))
        for n in range(8):
            expected = Level.of(state[n], everything, everything).goals[goal]
            if expected.exists:
                assert distances[n] == expected.distance
    assert (state.distances(np.full(8, -1)) == 0).all()
    mixed = state.distances(np.array([-1, EXIT_GOAL] * 4))
    assert (mixed[::2] == 0).all()
    assert (mixed[1::2] == state.distances(np.full(8, EXIT_GOAL))[1::2]).all()


def test_reward_is_found_by_module_and_name(tmp_path, monkeypatch):
    (tmp_path / "my_rewards_of_test.py").write_text(
        "import numpy as np\n"
        "def hurry(step):\n    return step.extrinsic - 0.5\n"
        "class Slow:\n    ends_with_option = True\n    memories = ('visited',)\n"
        "    def rewards(self, step):\n        return step.is_novel * 2\n"
    )
    monkeypatch.chdir(tmp_path)
    try:
        for step in play(make(n=3, reward="my_rewards_of_test:hurry", **SETTINGS), 30):
            np.testing.assert_array_equal(step.rewards, step.extrinsic - 0.5)
        turns = make(n=3, reward="my_rewards_of_test:Slow", **SETTINGS)
        steps = play(turns, 30)
        assert any(step.is_novel.any() for step in steps)
        for step in steps:
            np.testing.assert_array_equal(step.rewards, 2.0 * step.is_novel)
            np.testing.assert_array_equal(step.return_terminated, step.reached | step.terminated)
    finally:
        sys.modules.pop("my_rewards_of_test", None)


def odd(**attributes):
    return type("Odd", (), {"rewards": lambda self, step: step.extrinsic, **attributes})()


@pytest.mark.parametrize(
    ("reward", "said"),
    [
        ("nonsense", "a reward is one of extrinsic, bonus, intrinsic, novelty or package"),
        ("no_such_module:R", "there is no module 'no_such_module' for the reward 'no_such_module:R'"),
        (3, "a reward is a function of a step or has a method rewards(step); the reward int is neither"),
        (odd(memories=("smell",)), "levels can remember visited, "),
        (odd(memories="visited"), "memories must be a list of names, not 'visited'"),
        (odd(ends_with_option="no"), "ends_with_option must be True or False, not 'no'"),
        (odd(needs_states=property(lambda self: 1 / 0)), "fails: ZeroDivisionError: division by zero"),
    ],
)
def test_invalid_reward_raises_input_error(reward, said):
    with pytest.raises(InputError) as caught:
        make(reward=reward)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (lambda step: 1.0, "must return 4 numbers, one for each environment, not an array of float64"),
        (lambda step: np.full(4, np.nan), "the reward <lambda> must return finite numbers, not nan"),
        (lambda step: sys.exit(0), "the reward <lambda> fails: SystemExit"),
        (lambda step: step.terminated.__ior__(step.truncated), "ValueError: output array is read-only"),
        (lambda step: step.price, "fails: AttributeError: a step has no 'price' (line "),
    ],
)
def test_invalid_reward_result_raises_input_error(value, said):
    turns = make(n=4, reward=value, **SETTINGS)
    with pytest.raises(InputError) as caught:
        turns.step(np.zeros(4, np.int64))
    assert said in str(caught.value)


def test_reward_object_trains_but_cannot_be_saved():
    with pytest.raises(InputError, match="a run names its reward, like"):
        TrainConfig().changed(reward=Watching()).to_dict()
    reward = Watching()
    trainer = Trainer(TrainConfig().changed(reward=reward, steps=64, num_envs=4, size=11))
    trainer.advance()
    assert len(reward.steps) * 4 == trainer.steps
