"""Chains measured in real levels: the node an agent is at, and players with known numbers."""

import json

import numpy as np
import pytest
from turns_helpers import make

from hierroom.agents.player import OraclePlayer, RandomPlayer
from hierroom.commands.complexity import main as complexity
from hierroom.complexity import AugmentedGraph, Node
from hierroom.goals import NAMED_GRAPHS, GoalGraph, enumerate_graphs
from hierroom.lab.measure import count_transitions, graph_of, measure
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.layout import NO_MAPS
from hierroom.worlds.escape_room.rooms import NodeMap


def turns_in(*graphs, n=20, seed=3, **settings):
    return make(graphs, n, seed=seed, **settings)


def node_by_hand(level):
    """The mapping of `hierroom.lab.measure`, written down for one level with no arrays."""
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


def test_measured_random_policy_matches_its_episode_lengths():
    turns = turns_in(NAMED_GRAPHS["a"], n=100, max_steps=100_000)
    report = measure(turns, RandomPlayer(np.random.default_rng(5)), episodes=400)
    lengths = report.counts.lengths
    assert report.success_rate == 1
    assert report.chain.expected_steps == pytest.approx(lengths.mean(), rel=1e-9)
    _, low, high = report.intervals["expected_steps"]
    standard_error = lengths.std() / np.sqrt(len(lengths))
    assert low == pytest.approx(lengths.mean() - 1.96 * standard_error, rel=0.05)
    assert high == pytest.approx(lengths.mean() + 1.96 * standard_error, rel=0.05)
    # the whole curve is not an identity: it agrees as far as the goal states are Markov
    times = np.quantile(lengths, np.linspace(0.02, 0.98, 25)).astype(int)
    gap = np.abs(report.chain.reach_probability(times) - report.empirical_reach(times))
    assert gap.max() < 0.12


def test_measured_steps_to_goals_equal_the_played_ones():
    graph = NAMED_GRAPHS["c"]
    first = {"key 1": [], "door 1": [], "key 2": [], "door 2": []}

    class Noting(OraclePlayer):
        def step(self, turns):
            step = super().step(turns)
            for goal, times in first.items():
                bit = 1 << int(goal[-1]) - 1
                field = "found" if goal.startswith("key") else "doors"
                has = np.where(step.episode_ended, turns.world.finals[field], turns.world.state.levels[field]) & bit > 0
                new = has & ~done[goal]  # in the first episode of each environment
                times.extend(step.lengths[new].tolist())
                done[goal] |= has
            return step

    turns, done = turns_in(graph, n=50), {goal: np.zeros(50, bool) for goal in first}
    report = measure(turns, Noting(), episodes=50)
    for goal, times in first.items():
        assert report.chain.expected_steps_to(goal) == pytest.approx(np.mean(times), rel=1e-9), goal


class Spinner:
    """Turns on the spot."""

    def step(self, turns):
        return turns.step(np.ones(len(turns), int))


def test_count_transitions_counts_truncated_episodes_as_restarts():
    turns = turns_in(NAMED_GRAPHS["a"], n=4, max_steps=7)
    counts = count_transitions(turns, Spinner(), episodes=10)
    assert counts.lengths.tolist() == [7] * 10
    assert not counts.escaped.any()
    assert counts.total().toarray()[0, 0] == 10 * 8


def test_measuring_needs_one_graph_and_an_episode():
    graph = NAMED_GRAPHS["g"]
    assert graph_of(turns_in(graph, n=2)) == graph
    with pytest.raises(InputError, match="environments of one goal graph, not of 2"):
        measure(turns_in(graph, NAMED_GRAPHS["a"], n=2), OraclePlayer(), 2)
    with pytest.raises(InputError, match="at least one episode, not 0"):
        count_transitions(turns_in(graph, n=2), OraclePlayer(), 0)


def test_a_trained_agent_is_measured_from_its_run_folder(tmp_path, capsys):
    config = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=4)
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(Trainer(config).state_dict())
    complexity(["--from-play", str(folder.path), "--episodes", "8", "--json"])
    table = json.loads(capsys.readouterr().out)
    assert (table["graph"], table["drop_key"], table["episodes"]) == ("a", False, 8)
    with pytest.raises(InputError, match="trained without drop, so it cannot play with --drop"):
        complexity(["--from-play", str(folder.path), "--drop"])


@pytest.mark.slow
def test_agent_of_many_graphs_is_measured_on_one(tmp_path, capsys):
    config = TrainConfig(EnvConfig("hitting_time:8..13", exclude="a", size=11, max_steps=60), num_envs=4)
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(Trainer(config).state_dict())
    with pytest.raises(InputError, match=r"trained on \d+ goal graphs; name one by --graph"):
        complexity(["--from-play", str(folder.path)])
    own = tmp_path / "own.toml"
    GoalGraph((0, 1), 1).to_toml(own)
    complexity(["--from-play", str(folder.path), "--graph", str(own), "--episodes", "4", "--json"])
    table = json.loads(capsys.readouterr().out)
    assert (table["graph"], table["key_rooms"], table["exit_room"]) == ("own", {"key 1": 0, "key 2": 1}, 1)
