"""Random tech trees: all are solvable, and breadth-first search finds no shorter solution."""

from collections import deque

import numpy as np
import pytest
from workshop_twin import CRAFT, MELT

import hierroom
from hierroom import EnvConfig, InputError
from hierroom.worlds.workshop.goal_kernels import write_ranks
from hierroom.worlds.workshop.kernels import apply
from hierroom.worlds.workshop.task import workshop_of
from hierroom.worlds.workshop.tech_tree import tech_tree, tech_tree_of

SHAPES = ("mixed", "deep", "wide")
SIZES = (2, 3, 5, 8, 13, 24, 63)


def start_of(book):
    things = np.zeros((1, 3, len(book.things)), np.uint8)
    things[0, 0, : len(book.recipes.standing)] = book.recipes.standing
    things[0, 1] = book.recipes.start
    return things


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("n_goals", SIZES)
def test_every_tech_tree_is_solvable_and_uses_all_things(n_goals, shape):
    for seed in range(40 if n_goals < 30 else 2):
        rules = tech_tree(n_goals, seed, shape)
        task = hierroom.workshop(rules)
        assert len(rules.names) == n_goals
        asked = {fact for ways in rules.rules.values() for way in ways for fact in (*way.needs, *way.uses)}
        assert {*rules.facts} == asked | {"masterpiece"}
        things, book = start_of(task.book), task.book
        length, _ = task.solver.next_way(things[0])
        actions = task.solver.actions(things[0])
        assert len(actions) == length > 0
        made = 0
        while not things[0, 1, book.recipes.target]:  # follow fixed-dfs with a perfect controller
            ranks = np.zeros((1, n_goals), np.int64)
            write_ranks(things, book.recipes, ranks)
            order = sorted(range(n_goals), key=lambda goal, ranks=ranks: -ranks[0, goal])
            assert any(
                ranks[0, goal] and apply(things[0], book.recipes, goal) for goal in order if can(things, book, goal)
            )
            made += 1
            assert made <= 20 * length


def can(things, book, goal):
    return (things[0, 1] >= book.recipes.asks[goal]).all()


@pytest.mark.parametrize("rules", [CRAFT, MELT, tech_tree(4, 1), tech_tree(5, 2, "wide")], ids=lambda rules: rules.name)
def test_shortest_solutions_equal_breadth_first_search(rules):
    task = hierroom.workshop(rules)
    world = task.make_world(EnvConfig(task=task), 1, seed=3, autoreset=False)
    rng = np.random.default_rng(0)
    for _ in range(12):
        state = world.get_state()
        length = int(world.shortest_lengths(world.everywhere)[0])
        actions = world.shortest_actions(0)
        assert length == len(actions) == breadth_first(task, state)
        for action in actions:
            assert not world.outcomes["terminated"][0]
            world.step(np.array([action]))
        assert world.outcomes["terminated"][0]
        world.set_state(state)
        for action in rng.integers(0, world.n_actions, 5):
            world.step(np.array([action]))
        if world.outcomes["terminated"][0]:
            world.reset()


def breadth_first(task, state):
    """Return the fewest actions to the target, by trying each action in every state."""
    first = state[0].things.tobytes()
    world = task.make_world(EnvConfig(task=task, max_steps=10**6), 1, autoreset=False, seed=0)
    lengths, queue = {first: 0}, deque([first])
    while queue:
        before = queue.popleft()
        for action in range(world.n_actions):
            world._state.things[0] = np.frombuffer(before, np.uint8).reshape(state.things.shape[1:])
            world._state.shops["has_ended"] = False
            terminated = world.step(np.array([action]))["terminated"][0]
            after = world.state.things.tobytes()
            if terminated:
                return lengths[before] + 1
            if after not in lengths:
                lengths[after] = lengths[before] + 1
                queue.append(after)
    return -1


def test_tech_tree_name_has_size_seed_and_shape():
    assert workshop_of("8").rules == tech_tree_of("8:0:mixed") == tech_tree(8)
    assert workshop_of("8:3:deep").rules == tech_tree(8, 3, "deep")
    assert len({tech_tree(8, seed, shape) for seed in range(20) for shape in SHAPES}) == 60
    depths = {shape: [workshop_of(f"12:{n}:{shape}").book.recipes.depths.max() for n in range(9)] for shape in SHAPES}
    assert np.mean(depths["deep"]) > np.mean(depths["mixed"]) > np.mean(depths["wide"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "such as workshop:8:3:deep, not 'workshop:'"),
        ("8:3:deep:2", "such as workshop:8:3:deep, not"),
        ("-8", "such as workshop:8:3:deep, not"),
        ("1", "the number of goals of a workshop must be at least 2, not 1"),
        ("64", "the number of goals of a workshop must be at most 63, not 64"),
        ("8:3:tall", "the shape of a workshop must be one of mixed, deep, wide, either, not 'tall'"),
    ],
)
def test_invalid_tree_name_raises_input_error(text, said):
    with pytest.raises(InputError, match=said):
        workshop_of(text)
