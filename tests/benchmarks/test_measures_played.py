"""Chains measured in real levels: the node an agent is at, and players with known numbers."""

import numpy as np
import pytest
from turns_helpers import make

from benchmarks.measures.played import NodeMap, measure_play
from hierroom.agents.player import OraclePlayer, RandomPlayer
from hierroom.complexity import AugmentedGraph, Node
from hierroom.goals import NAMED_GRAPHS, enumerate_graphs
from hierroom.worlds.escape_room.layout import NO_MAPS


def turns_in(*graphs, n=20, seed=3, **settings):
    return make(graphs, n, seed=seed, **settings)


def node_by_hand(level):
    """The mapping, written down for one level with no arrays."""
    branches = range(int(level["n_rooms"]) - 1)
    doors = tuple(b + 1 for b in branches if int(level["doors"]) >> b & 1)
    bag = [int(b) for b in level["bag"][: int(level["bag_size"])]]
    locked = [b for b in bag if b + 1 not in doors]
    if locked:
        return Node("key", locked[-1] + 1, doors)
    for r in range(int(level["n_rooms"])):
        top, left, bottom, right = level["rectangles"][r]
        if top <= level["row"] <= bottom and left <= level["col"] <= right:
            return Node("room", r, doors)
    return next(
        Node("room", b + 1, doors) for b in branches if tuple(level["doors_at"][b]) == (level["row"], level["col"])
    )


@pytest.mark.parametrize("drop_key", [False, True])
def test_node_map_equals_the_plain_mapping(drop_key):
    rng, seen = np.random.default_rng(0), set()
    for graph in [*NAMED_GRAPHS.values(), enumerate_graphs(7)[100]]:
        augmented = AugmentedGraph(graph, drop_key)
        node_of, turns = NodeMap(augmented, NO_MAPS), turns_in(graph, n=12, drop_key=drop_key, max_steps=2000)
        # first shortest solutions, then random actions: far into the level and off the shortest way
        steer = OraclePlayer()
        for _ in range(40):
            steer.step(turns)
        for _ in range(150):
            turns.step(rng.choice([0, 0, 1, 2, 3, 4, 5], size=12))
            levels = turns.world.state.levels
            nodes = node_of(levels, np.zeros(12, bool))
            assert [augmented.nodes[i] for i in nodes] == [node_by_hand(level) for level in levels]
            seen |= {augmented.nodes[i].kind for i in nodes}
    assert seen == {"room", "key"}


def test_chain_mean_equals_the_mean_of_episodes():
    turns, firsts = turns_in(NAMED_GRAPHS["a"], n=50, max_steps=100_000), {}

    class Noting(RandomPlayer):
        def step(self, turns):
            step = super().step(turns)
            for env in np.flatnonzero(step.episode_ended):
                firsts.setdefault(env, int(step.lengths[env]))
            return step

    played = measure_play(turns, Noting(np.random.default_rng(5)), episodes=50)
    assert played.success_rate == 1
    assert played.chain.expected_steps == pytest.approx(np.mean([*firsts.values()]), rel=1e-9)


class Spinner:
    """Turns on the spot."""

    def step(self, turns):
        return turns.step(np.ones(len(turns), int))


def test_missed_episodes_restart_in_one_more_step():
    played = measure_play(turns_in(NAMED_GRAPHS["a"], n=4, max_steps=7), Spinner(), episodes=10)
    assert (played.success_rate, played.chain.expected_steps) == (0, np.inf)
    assert played.chain.weights.toarray()[0].tolist() == [1, 0, 0, 0, 0]
    assert played.chain.weights[4, 0] == 0.01
