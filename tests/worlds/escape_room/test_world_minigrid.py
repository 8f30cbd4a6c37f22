"""The world equals MiniGrid: views, positions, rewards, ends of episodes, pictures."""

from types import SimpleNamespace

import minigrid.core.grid
import numpy as np
import pytest
from minigrid.core.constants import COLOR_TO_IDX, OBJECT_TO_IDX, STATE_TO_IDX
from minigrid.core.grid import Grid
from minigrid.core.world_object import Wall
from minigrid_level import MiniGridLevel

from hierroom.goals import COLOURS, NAMED_GRAPHS, GoalGraph
from hierroom.worlds.escape_room import constants, tiles, view_kernels
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.render import draw_level

GRAPHS = [*NAMED_GRAPHS.values(), GoalGraph((0, 0, 1, 0, 2, 4), 5)]


def expected(observation):
    image = observation["image"].copy()
    is_door = image[..., 0] == OBJECT_TO_IDX["door"]
    image[..., 2] = is_door & (image[..., 2] == STATE_TO_IDX["open"])
    return image


def assert_equal(world, env, observation):
    level = world.state.levels[0]
    np.testing.assert_array_equal(tiles.encode(world.outcomes["tiles"])[0], expected(observation))
    assert (level.row - constants.MARGIN, level.col - constants.MARGIN) == (env.agent_pos[1], env.agent_pos[0])
    assert level.direction == env.agent_dir
    assert level.steps == env.step_count
    assert [key.color for key in env.bag] == [COLOURS[level.colours[branch]] for branch in level.bag[: level.bag_size]]


def play(world, env, actions):
    observation, _ = env.reset()
    assert_equal(world, env, observation)
    taken = 0
    for taken, action in enumerate(actions, start=1):  # noqa: B007 - it is returned
        outcome = world.step_within_episode(np.array([action]))[0]
        observation, reward, terminated, truncated, _ = env.step(action)
        assert (outcome.reward, outcome.terminated, outcome.truncated) == (reward, terminated, truncated)
        assert_equal(world, env, observation)
        if terminated or truncated:
            break
    return taken


def bold_actions(world, rng):
    while True:
        level = world.state.levels[0]
        ahead = level.row + constants.ROW_STEP[level.direction], level.col + constants.COL_STEP[level.direction]
        tile = world.state.grids[0][ahead]
        if rng.random() < 0.5 and constants.KEY <= tile < constants.OPEN_DOOR:
            yield constants.PICKUP
        elif rng.random() < 0.5 and constants.LOCKED_DOOR <= tile < constants.WALL:
            yield constants.OPEN
        else:
            yield rng.choice(6, p=[0.5, 0.15, 0.15, 0.05, 0.05, 0.1])


@pytest.mark.parametrize("can_drop", [False, True], ids=["", "drop"])
@pytest.mark.parametrize("size", [11, 19, 31])
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_random_walks_equal_minigrid(graph, size, can_drop):
    rng = np.random.default_rng(size)
    world = Engine([graph], size=size, seed=8, drop_key=can_drop, max_steps=150)
    taken = 0
    while taken < 500:
        taken += play(world, MiniGridLevel(world.state), bold_actions(world, rng))
        world.reset()


@pytest.mark.parametrize("size", [11, 19, 31])
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_oracle_episodes_equal_minigrid(graph, size):
    world = Engine([graph], size=size, seed=9)
    for _ in range(3):
        path = shortest_actions(world.state)
        assert play(world, MiniGridLevel(world.state), path) == len(path)
        assert world.outcomes[0].terminated
        world.reset()


def test_spread_of_light_equals_minigrid_on_every_row(monkeypatch):
    """All 128 x 128 rows (light falling on them, cells it passes), against MiniGrid's own sweeps."""
    bits = 1 << np.arange(7)
    assert view_kernels.spread(0, 127) == (0, 0)
    for clear in range(128):
        for lit in range(1, 128):
            grid = Grid(7, 3)
            for i in range(7):
                grid.set(i, 1, Wall())
                grid.set(i, 2, None if clear >> i & 1 else Wall())
            mask = np.zeros((7, 3), bool)
            mask[:, 2] = lit & bits
            # MiniGrid lights one cell of an empty mask; here that mask comes with the row already lit.
            monkeypatch.setattr(minigrid.core.grid, "np", SimpleNamespace(zeros=lambda mask=mask, **_: mask))
            grid.process_vis((int(np.argmax(mask[:, 2])), 2))
            seen, ahead = view_kernels.spread(lit, clear)
            assert (seen, ahead) == (bits @ mask[:, 2], bits @ mask[:, 1]), (lit, clear)


def test_colour_and_object_ids_equal_minigrid():
    assert [COLOR_TO_IDX[name] for name in COLOURS] == list(range(6))
    names = {"empty": tiles.EMPTY_ID, "wall": tiles.WALL_ID, "door": tiles.DOOR_ID, "key": tiles.KEY_ID}
    assert {**names, "goal": tiles.GOAL_ID, "unseen": 0}.items() <= OBJECT_TO_IDX.items()


@pytest.mark.parametrize(("size", "tile_size"), [(11, 32), (19, 12)])
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_pictures_equal_minigrid(graph, size, tile_size):
    world = Engine([graph], size=size, seed=10)
    env = MiniGridLevel(world.state, render_mode="rgb_array", tile_size=tile_size)
    env.reset()
    for action in [*shortest_actions(world.state)[:-1], -1]:
        np.testing.assert_array_equal(draw_level(world.state, tile_size=tile_size), env.render())
        world.step_within_episode(np.array([action]))
        env.step(action)
