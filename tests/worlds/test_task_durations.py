"""Actions that take several primitive steps, as the environment reports."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import hierroom
from hierroom import EnvConfig
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns


class Waits(gymnasium.Env):
    """Each action takes as many steps as its number, and two more."""

    observation_space, action_space = spaces.Discrete(5), spaces.Discrete(3)
    reported = staticmethod(lambda action: {"elapsed": action + 2})

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.t = 0
        return 0, {}

    def step(self, action):
        self.t += 1
        return self.t, 1.0, self.t == 4, False, self.reported(int(action))


class Confused(Waits):
    reported = staticmethod(lambda action: {"elapsed": 0.5})


def is_late(env, info):
    return env.unwrapped.t >= 3


def turns_of(make):
    task = hierroom.Task(make=make, goals={"late": is_late}, target="late")
    turns = Turns(EnvConfig(task=task), 2, seed=0)
    turns.reset()
    turns.choose(turns.situation(np.arange(2)), np.array([0, 0]))
    return turns


def step(turns, *actions):
    turns.act("controller_0", turns.observe("controller_0", np.arange(2)), np.array(actions))
    return turns.step()


def test_options_last_as_long_as_their_actions():
    turns = turns_of(Waits)
    taken = [step(turns, 0, action) for action in (1, 2)]
    assert [one.elapsed.tolist() for one in taken] == [[2, 3], [2, 4]]
    assert taken[1].meta_elapsed.tolist() == [4, 7]
    assert taken[1].lengths.tolist() == [2, 2]  # of decisions: the limits of episodes count them


def test_learner_discounts_by_the_duration():
    taken = step(turns_of(Waits), 0, 1)
    assert taken.ended_turns("controller_0")[2].tolist() == [2, 3]


def test_duration_that_is_no_number_of_steps_is_refused():
    with pytest.raises(InputError, match=r"info\['elapsed'\] of task, .* a whole number from 1 to 1,000,000, not 0.5"):
        step(turns_of(Confused), 0, 0)
