"""What an environment is made of: wrong entries are one clear line wherever they stand, and public names explain."""

import inspect

import gymnasium
import numpy as np
import pytest

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

WRONG = [
    ({"goal_mask": "some"}, "goal_mask is one of reachable, existing, seen, none, not 'some'"),
    ({"novelty_bonus": "x"}, "novelty_bonus must be a number from 0 to 1,000,000, not 'x'"),
    ({"novelty_bonus": -0.1}, "novelty_bonus must be a number from 0 to 1,000,000, not -0.1"),
    ({"env_index": "a"}, "env_index must be a whole number of at least 0, not 'a'"),
    ({"env_index": -1}, "env_index must be a whole number of at least 0, not -1"),
    ({"drop_key": "no"}, "drop_key must be True or False, not 'no'"),
    ({"subgoal_horizon": True}, "subgoal_horizon must be a whole number of at least 1 or None, not True"),
    ({"subgoal_horizon": 0}, "subgoal_horizon must be a whole number of at least 1 or None, not 0"),
    ({"curriculum_stages": 0}, "curriculum_stages must be a whole number of at least 1, not 0"),
]


@pytest.mark.parametrize("make", [hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms, EnvConfig])
@pytest.mark.parametrize(("entry", "said"), WRONG)
def test_a_wrong_entry_is_one_clear_line(make, entry, said):
    with pytest.raises(InputError) as caught:
        make(**entry)
    assert str(caught.value) == said


def test_numbers_of_numpy_are_numbers():
    config = EnvConfig("c", env_index=np.int64(3), subgoal_horizon=np.int32(5), drop_key=np.bool_(True))
    assert Turns(config, seed=0).world.state.levels["index"].tolist() == [3]


@pytest.mark.parametrize("api", ["vector", "parallel", "gymnasium"])
def test_nothing_is_stepped_or_drawn_before_the_first_reset(api):
    made = {"vector": EscapeRooms(2), "parallel": hierroom.parallel_env(), "gymnasium": EscapeRoom()}[api]
    with pytest.raises(InputError, match="reset the environment before"):
        made.step(np.zeros(2, int)) if api == "vector" else made.render()


def test_the_checked_environment_explains_itself():
    assert hierroom.env.__name__ == "env"
    assert "checks of order and bounds" in hierroom.env.__doc__
    for made in (hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms):
        assert "`EnvConfig`" in made.__doc__, made
    for name in vars(EnvConfig()):
        assert f"    {name}: " in inspect.cleandoc(EnvConfig.__doc__), name


def test_the_package_tells_its_public_names():
    assert set(hierroom.__all__) <= set(dir(hierroom))
    assert all(getattr(hierroom, name) for name in hierroom.__all__)
    assert callable(hierroom.parallel_env)
    import hierroom.parallel_env as module_or_class

    assert hierroom.parallel_env is module_or_class
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = hierroom.nothing


def test_one_id_takes_any_graph():
    env = gymnasium.make("hierroom/EscapeRoom-v0", graph="expected_steps:20..70", curriculum_stages=2)
    env.reset(seed=0)
    assert env.unwrapped.complexity.expected_steps <= 70
