"""The exact steps of random play in a workshop, against numbers worked by hand and play itself."""

import numpy as np
import pytest

from benchmarks.study.random_work import random_steps
from hierroom import Rules, workshop
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import make_world
from hierroom.worlds.workshop.tech_tree import tech_tree


def test_random_steps_of_one_recipe_by_hand():
    # Three actions: put the source, work, clear. From an empty bench the source is put in 3 steps on average; then
    # work ends it, clear begins again and a second put changes nothing: m = 3 + n, n = 1 + n / 3 + m / 3, so m = 9.
    recipes = workshop(Rules({"wood": {"gives": "wood"}}, target="wood")).book.recipes
    assert random_steps(recipes) == pytest.approx(9)


@pytest.mark.parametrize("tree", [(2, 0, "mixed"), (4, 1, "either")])
def test_random_steps_equal_simulated_play(tree):
    task = workshop(tech_tree(*tree))
    world = make_world(EnvConfig(task=task, max_steps=1_000_000), 64)
    world.reset(seed=0)
    actions, lengths = np.random.default_rng(0), []
    while len(lengths) < 2000:
        outcome = world.step(actions.integers(task.n_actions, size=64))
        lengths += outcome["length"][outcome["terminated"]].tolist()
    assert random_steps(task.book.recipes) == pytest.approx(np.mean(lengths), abs=4 * np.std(lengths) / 2000**0.5)
