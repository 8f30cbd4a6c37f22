"""Settings of an environment, and the public names of the package."""

import inspect

import numpy as np
import pytest

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig


def test_env_config_takes_numpy_numbers():
    config = EnvConfig("c", env_index=np.int64(3), subgoal_horizon=np.int32(5), drop_key=np.bool_(True))
    assert Turns(config, seed=0).world.state.levels["index"].tolist() == [3]


def test_docstrings_name_every_env_config_entry():
    assert hierroom.env.__name__ == "env"
    assert "checks of order and bounds" in hierroom.env.__doc__
    for made in (hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms):
        assert "other entries of the `EnvConfig`" in inspect.cleandoc(made.__doc__)
    for name in vars(EnvConfig()):
        assert f"    {name}: " in inspect.cleandoc(EnvConfig.__doc__)


def test_package_exports_its_public_names():
    assert set(hierroom.__all__) <= set(dir(hierroom))
    assert callable(hierroom.parallel_env)
    import hierroom.parallel_env as module_or_class

    assert hierroom.parallel_env is module_or_class
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = hierroom.nothing
