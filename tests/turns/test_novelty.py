"""The episodic first-visit bonus: novel states, compared with a set kept by the test, and their reward."""

import numpy as np
import pytest
from turns_helpers import achieve, make, well_or_wildly

import hierroom
from hierroom.goals import NAMED_GRAPHS
from hierroom.worlds.env_config import NOVELTY_BONUS
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, PICKUP
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.oracle import shortest_actions


def state_of(level):
    return int(level.row), int(level.col), int(level.found), int(level.doors)


@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("size", [11, 63])
def test_state_is_novel_at_its_first_visit(size, drop_key):
    world = Engine([NAMED_GRAPHS["f"]], size=size, max_steps=400, drop_key=drop_key, memories=["visited"])
    rng = np.random.default_rng(0)
    n_novel = 0
    for _ in range(6 if size == 11 else 2):
        entered = {state_of(world.state.levels[0])}
        while True:
            outcome = world.step([well_or_wildly(rng, world) if size == 11 else rng.choice(5, p=[0.6, *[0.1] * 4])])[0]
            has_ended = outcome.terminated or outcome.truncated
            state = state_of(world.finals[0] if has_ended else world.state.levels[0])
            assert outcome.is_novel == (state not in entered)
            entered.add(state)
            n_novel += outcome.is_novel
            if has_ended:
                break
    assert n_novel > 100


def test_novelty_reward_pays_exit_and_new_states():
    turns = make("a", reward="novelty", novelty_bonus=0.25)
    achieve(turns, "k1")
    assert turns.step([LEFT]).rewards.tolist() == [0.0]  # a state has no direction
    achieve(turns, "d1")
    rewards = [turns.step([action]).rewards[0] for action in shortest_actions(turns.world.get_state())]
    assert set(rewards[:-1]) <= {0.0, 0.25}
    assert rewards[-1] == 1.25


def test_dropping_and_retaking_a_key_is_not_novel():
    turns = make("c", reward="novelty", drop_key=True)
    achieve(turns, "k1")
    for action in (DROP, PICKUP) * 3:
        step = turns.step([action])
        assert step.rewards[0] == 0.0
    assert step.events[0] >= 0


@pytest.mark.parametrize(("settings", "bonus"), [({}, NOVELTY_BONUS), ({"novelty_bonus": 0.25}, 0.25)])
def test_parallel_env_pays_the_novelty_bonus(settings, bonus):
    env = hierroom.parallel_env(graph="a", size=11, reward="novelty", **settings)
    env.reset(seed=0)
    rewards = [env.step({"meta_0": 13, "controller_0": action})[1]["controller_0"] for action in [FORWARD, LEFT] * 10]
    assert set(rewards) == {0.0, bonus}
