"""The checkers of PettingZoo and Gymnasium, over every graph, with and without dropping.

We leave out PettingZoo's ``max_cycles_test``, which requires every agent to act exactly ``max_cycles`` times, and
``bombardment_test``, which requires an observation of ``step``: no AEC environment with uneven turns can pass them.
"""

import warnings
from functools import partial
from types import SimpleNamespace

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, render_test, seed_test

import hierroom

GRAPHS = "abcdefg"
EXPECTED = (
    # An action mask stands next to the observation, in a dict; PettingZoo keeps a list of its own environments
    # that may have one and warns of all others.
    "Observation is not a NumPy array",
    "Observation space for each agent probably should be gymnasium.spaces.box or gymnasium.spaces.discrete",
    # The meta-controller has 14 actions and the controller 5 or 6, so their masks differ in length.
    "Agents have different observation space sizes",
    # PettingZoo's own option of a reset.
    "a reset takes .*; it ignores 'options' .*",
)

pytestmark = [
    pytest.mark.parametrize("graph", GRAPHS),
    pytest.mark.parametrize("drop_key", [False, True], ids=["", "drop"]),
]


@pytest.fixture(autouse=True)
def no_other_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for message in EXPECTED:
            warnings.filterwarnings("ignore", f"{message}$", UserWarning)
        yield


@pytest.mark.parametrize("make", [hierroom.env, hierroom.raw_env], ids=["env", "raw_env"])
def test_aec_env_passes_api_checker(make, graph, drop_key, capsys):
    api_test(make(graph=graph, drop_key=drop_key, max_steps=100), num_cycles=300)


def test_aec_env_passes_seed_checker(graph, drop_key):
    seed_test(partial(hierroom.env, graph=graph, drop_key=drop_key, max_steps=100), num_cycles=200)


def test_aec_env_passes_render_checker(graph, drop_key, monkeypatch):
    monkeypatch.setattr("pygame.time.Clock", lambda: SimpleNamespace(tick=lambda fps: None))  # as fast as possible
    render_test(partial(hierroom.env, graph=graph, drop_key=drop_key, size=11))


def test_parallel_env_passes_parallel_api_checker(graph, drop_key, capsys):
    parallel_api_test(hierroom.parallel_env(graph=graph, drop_key=drop_key, max_steps=100), num_cycles=300)


def test_parallel_env_passes_parallel_seed_checker(graph, drop_key):
    parallel_seed_test(partial(hierroom.parallel_env, graph=graph, drop_key=drop_key, max_steps=100), num_cycles=200)


@pytest.mark.parametrize("meta", ["none", "fixed-dfs"])
def test_gymnasium_env_passes_env_checker(graph, drop_key, meta):
    check_env(gymnasium.make(f"hierroom/EscapeRoom-{graph}-v0", drop_key=drop_key, meta=meta).unwrapped)
