"""Levels of training and of evaluation never have the same layout, with any seeds."""

import numpy as np
import pytest

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.engine import Engine


def layouts(graph, size, levels, seed=0, n=300, episodes=4):
    world = Engine([GoalGraph.named(graph)], n, size=size, seed=seed, levels=levels)
    grids = []
    for _ in range(episodes):
        grids += [grid.tobytes() for grid in world.state.grids]
        world.reset()
    return grids


def is_held_out(grid):
    digest = 0xCBF29CE484222325
    for tile in grid:
        digest = (digest ^ tile) * 0x100000001B3 % 2**64
    return digest < 2**61


@pytest.mark.parametrize("size", [11, 19, 31])
@pytest.mark.parametrize("graph", ["a", "g"])
def test_training_and_evaluation_share_no_layout(graph, size):
    every = layouts(graph, size, None)
    training, evaluation = layouts(graph, size, "training"), layouts(graph, size, "evaluation")
    assert not set(training) & set(evaluation)
    assert not any(map(is_held_out, training))
    assert all(map(is_held_out, evaluation))
    assert 0.09 < np.mean([is_held_out(grid) for grid in every]) < 0.16
    kept = [grid for grid in every if not is_held_out(grid)]  # levels that are not held out stay
    assert kept == [grid for grid, before in zip(training, every, strict=True) if grid == before]


@pytest.mark.parametrize("graph", NAMED_GRAPHS)
def test_run_trains_and_evaluates_on_separate_levels(graph):
    config = TrainConfig(EnvConfig(graph, size=11, max_steps=20), num_envs=16, steps=1024)
    trainer = Trainer(config)
    grids = trainer.fresh_turns(16, config.seed).world.state.grids
    assert all(is_held_out(grid.tobytes()) for grid in grids)
    assert not any(is_held_out(grid.tobytes()) for grid in trainer.turns.world.state.grids)
