"""The MiniGrid view: MiniGrid's own code sees the same level, and each of its wrappers works."""

import re

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from minigrid import wrappers
from minigrid.core.actions import Actions

import hierroom
from hierroom import InputError
from hierroom import minigrid_view as view
from hierroom.goals import COLOURS, GOAL_VECTORS
from hierroom.worlds.escape_room.oracle import shortest_actions

TO_MINIGRID = (Actions.forward, Actions.left, Actions.right, Actions.pickup, Actions.toggle, Actions.drop)


def make(env_id="hierroom/EscapeRoom-b-v0", **settings):
    return hierroom.minigrid_view(gymnasium.make(env_id, **{"size": 13, "max_steps": 200, **settings}))


@pytest.mark.filterwarnings("ignore:.*For Box action spaces:UserWarning")
def test_minigrid_view_passes_check_env():
    check_env(make(), skip_render_check=True)


@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("meta", ["none", "fixed-dfs"])
def test_view_equals_minigrid_and_the_plain_environment(drop_key, meta):
    """Play at random and towards the exit, next to the plain environment."""
    settings = {"graph": "e", "size": 13, "max_steps": 200, "drop_key": drop_key, "meta": meta, "reward": "bonus"}
    plain = gymnasium.make("hierroom/EscapeRoom-v0", **settings)
    env = hierroom.minigrid_view(gymnasium.make("hierroom/EscapeRoom-v0", **settings))
    rng, carried, missions = np.random.default_rng(0), set(), set()
    (seen, info), (expected, expected_info) = env.reset(seed=2), plain.reset(seed=2)
    for t in range(600):
        assert info == expected_info
        again = env.gen_obs()
        np.testing.assert_array_equal(seen["image"], again["image"])
        assert seen["direction"] == again["direction"] == expected["direction"]
        assert seen["mission"] == again["mission"]
        assert env.observation_space.contains(seen)
        goal = np.flatnonzero((expected["goal"] == GOAL_VECTORS).all(axis=1))[0]
        if goal < 12:
            verb, thing = (("pick up", "key"), ("open", "door"))[goal // 6]
            assert seen["mission"] == f"{verb} the {COLOURS[goal % 6]} {thing}"
        else:
            assert seen["mission"].endswith("square" if goal == 12 else "goal")
        missions.add(seen["mission"])
        carried.add(env.carrying and env.carrying.color)
        state = plain.unwrapped.single.turns.world.get_state()
        action = int(shortest_actions(state)[0]) if t % 200 < 190 and t % 3 else int(rng.integers(5 + drop_key))
        (seen, *results, info) = env.step(int(TO_MINIGRID[action]))
        (expected, *expected_results, expected_info) = plain.step(action)
        assert results == expected_results
        if results[1] or results[2]:
            (seen, info), (expected, expected_info) = env.reset(), plain.reset()
    assert len(carried) > 2
    assert (len(missions) > 3) == (meta != "none")


def test_the_mission_stays_to_the_end_of_the_episode():
    env = make(max_steps=5, meta="fixed-dfs")
    missions = {env.reset(seed=np.int64(3))[0]["mission"], *(env.step(0)[0]["mission"] for _ in range(5))}
    assert len(missions) == 1
    assert missions <= {f"pick up the {colour} key" for colour in COLOURS}


@pytest.mark.parametrize("action", [Actions.drop, Actions.done])
def test_actions_without_a_counterpart_only_cost_the_step(action):
    env = make()
    before, info = env.reset(seed=0)
    after, *_, info = env.step(action)
    np.testing.assert_array_equal(before["image"], after["image"])
    assert env.step_count == info["illegal_actions"] == 1


class Reseeded(wrappers.ReseedWrapper):
    def __init__(self, env):
        super().__init__(env, seeds=[1, 2])


SAME = ("ImgObs", "DictObservationSpace", "ViewSize", "DirectionObs", "StochasticAction")
WRAPPERS = {
    **dict.fromkeys([getattr(wrappers, f"{name}Wrapper") for name in SAME], (7, 7, 3)),
    **dict.fromkeys((wrappers.ActionBonus, wrappers.PositionBonus, Reseeded), (7, 7, 3)),
    **dict.fromkeys((wrappers.FullyObsWrapper, wrappers.SymbolicObsWrapper), (13, 13, 3)),
    wrappers.FlatObsWrapper: (2835,),
    wrappers.OneHotPartialObsWrapper: (7, 7, 20),
    wrappers.RGBImgObsWrapper: (13 * 8, 13 * 8, 3),
    wrappers.RGBImgPartialObsWrapper: (7 * 8, 7 * 8, 3),
}


@pytest.mark.filterwarnings("ignore:.*A seed has been passed:UserWarning")
@pytest.mark.parametrize("wrapper", WRAPPERS)
def test_each_minigrid_wrapper_works(wrapper):
    env = wrapper(make(graph="b", env_id="hierroom/EscapeRoom-v0", meta="fixed-dfs", max_steps=40))
    rng = np.random.default_rng(0)
    observation, _ = env.reset(seed=0)
    for _ in range(100):
        assert env.observation_space.contains(observation)
        image = observation["image"] if isinstance(observation, dict) else observation
        assert image.shape == WRAPPERS[wrapper]
        observation, _, terminated, truncated, _ = env.step(int(rng.integers(7)))
        if terminated or truncated:
            observation, _ = env.reset()


@pytest.mark.parametrize(
    ("attempt", "said"),
    [
        (lambda: view(gymnasium.make("CartPole-v1")), "minigrid_view takes a Gymnasium environment of hierroom, not"),
        (lambda: view(hierroom.env()), "minigrid_view takes a Gymnasium environment of hierroom, not"),
        (
            lambda: view(gymnasium.wrappers.FlattenObservation(gymnasium.make("hierroom/EscapeRoom-a-v0"))),
            "minigrid_view takes the environment without wrappers that change its observations",
        ),
        (lambda: make().reset(seed=-1), "a seed must be a whole number from 0 to 2**63 - 1, not -1"),
        (lambda: make().reset(seed="x"), "a seed must be a whole number from 0 to 2**63 - 1, not 'x'"),
        (lambda: make().step(7), "MiniGrid's actions are 0 to 6, not 7"),
        (lambda: make().step(np.array([0, 1])), "an action must be a whole number, not"),
    ],
)
def test_invalid_uses_raise_input_error(attempt, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        attempt()
    assert "\n" not in str(caught.value)
