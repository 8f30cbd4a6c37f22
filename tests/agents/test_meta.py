"""The meta-controllers that ship: which goals they choose, how often, and that the batch does not matter."""

from collections import Counter
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.stats import chisquare

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GoalGraph
from hierroom.meta import make_meta, take_turn
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.oracle import shortest_actions, shortest_lengths

SEVEN_ROOMS = GoalGraph((0, 0, 1, 0, 2, 4), 5)
GRAPHS = [*map(GoalGraph.named, "acdefg"), SEVEN_ROOMS]


def make(graph, n=1, *, seed=0, **settings):
    return Turns(EnvConfig(graph=graph, size=13, **settings), n, seed=seed)


def depth_first_paths(graph):
    paths = Counter()

    def descend(path, rooms, chance):
        """Rooms: those entered and not left again, the deepest one last."""
        if f"door {graph.exit_room}" in path:
            paths[*path, "exit"] += chance
            return
        keys = [r for r, home in enumerate(graph.key_rooms, 1) if home == rooms[-1] and f"key {r}" not in path]
        for room in keys:
            descend((*path, f"key {room}", f"door {room}"), [*rooms, room], chance / len(keys))
        if not keys:
            descend(path, rooms[:-1], chance)

    descend((), [0], Fraction(1))
    return paths


def test_depth_first_paths_of_two_graphs_by_hand():
    dead_end = ("key 2", "door 2")
    way_out = ("key 1", "door 1", "key 3", "door 3", "exit")
    assert depth_first_paths(GoalGraph.named("f")) == {way_out: Fraction(1, 2), (*dead_end, *way_out): Fraction(1, 2)}
    assert depth_first_paths(GoalGraph.named("d")) == {
        ("key 2", "door 2", "exit"): Fraction(1, 2),
        ("key 1", "door 1", "key 3", "door 3", "key 2", "door 2", "exit"): Fraction(1, 2),
    }


def name(level, goal):
    if goal == EXIT_GOAL:
        return "exit"
    branch = level.colours.tolist().index(goal % FIRST_DOOR_GOAL)
    return f"{'key' if goal < FIRST_DOOR_GOAL else 'door'} {branch + 1}"


@pytest.mark.parametrize("goal_mask", ["reachable", "none"])
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_fixed_dfs_is_uniform_over_depth_first_paths(graph, goal_mask):
    """In 3000 levels of the same colours, where every goal is achieved as soon as it is chosen, by magic."""
    n = 3000
    turns, meta = make(graph, n, goal_mask=goal_mask), make_meta("fixed-dfs")
    turns.world._state.levels["colours"] = turns.world._state.levels["branches"] = np.arange(6)
    levels, paths = turns.world._state.levels, [() for _ in range(n)]
    for turn in range(1, 2 * graph.n_rooms):
        take_turn(meta, turns)
        for i, goal in enumerate(turns.goals.tolist()):
            if "exit" not in paths[i]:
                paths[i] += (name(levels[i], goal),)
                kind, _, room = paths[i][-1].partition(" ")
                if kind == "key":
                    levels[i].keys |= 1 << int(room) - 1
                elif kind == "door":
                    levels[i].doors |= 1 << int(room) - 1
                    levels[i].opened_at[int(room) - 1] = turn
        turns.ledger.write_fields({"is_meta_turn": True})
    expected, counts = depth_first_paths(graph), Counter(paths)
    assert counts.keys() == expected.keys()
    if len(expected) > 1:
        frequencies = [float(expected[path] * n) for path in expected]
        assert chisquare([counts[path] for path in expected], frequencies).pvalue > 1e-3


def test_fixed_dfs_chooses_no_goal_before_seeing_a_key():
    turns = make(SEVEN_ROOMS, 64, goal_mask="seen")
    take_turn(make_meta("fixed-dfs"), turns)
    has_seen_a_key = (turns.world.state.levels["seen"] & 63) > 0
    assert 0 < has_seen_a_key.sum() < 64
    assert ((turns.goals >= 0) <= has_seen_a_key).all()
    assert (turns.goals[~has_seen_a_key] == -1).all()


@pytest.mark.parametrize("spec", ["fixed-dfs", "random"])
def test_meta_controller_without_legal_goal_chooses_none(spec):
    situation = make(SEVEN_ROOMS, 5).situation(np.arange(5))
    nothing = replace(situation, masks=np.zeros((5, 14), bool))
    assert make_meta(spec).choose(nothing.as_dict(), nothing.legal, nothing).tolist() == [-1] * 5


def test_random_goals_are_legal_and_uniform():
    turns = make(GoalGraph.named("e"), 3000)
    turns.world._state.levels["colours"] = turns.world._state.levels["branches"] = np.arange(6)
    take_turn(make_meta("random"), turns)
    colours = turns.world.state.levels["colours"][:, :3]
    chosen = (colours == turns.goals[:, None]).nonzero()
    assert len(chosen[0]) == 3000
    assert chisquare(np.bincount(chosen[1])).pvalue > 1e-3


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_oracle_goals_follow_a_shortest_way(graph):
    turns, meta = make(graph, seed=2), make_meta("oracle")
    for _ in range(8):
        shortest, step = shortest_lengths(turns.world.get_state())[0], None
        while step is None or not step.episode_ended[0]:
            take_turn(meta, turns)
            goal, step = turns.goals[0], None
            for action in shortest_actions(turns.world.get_state()):
                step = turns.step([action])
                if step.events[0] >= 0:
                    break
            assert step.events[0] == goal
        assert step.lengths[0] == shortest


@pytest.mark.parametrize("spec", ["fixed-dfs", "random", "oracle"])
def test_environment_gets_the_same_goals_alone_and_among_others(spec):
    graph, n = GoalGraph.named("e"), 128
    alone = {k: make(graph, seed=5, env_index=k, subgoal_horizon=6) for k in (0, 1, 77, 127)}
    together, meta = make(graph, n, seed=5, subgoal_horizon=6), make_meta(spec)
    rng, given = np.random.default_rng(0), set()
    for _ in range(60 if spec == "oracle" else 300):
        actions = rng.integers(5, size=n)
        take_turn(meta, together)
        for k, turns in alone.items():
            take_turn(meta, turns)
            assert turns.goals[0] == together.goals[k]
            given.add(int(together.goals[k]))
            turns.step(actions[[k]])
        together.step(actions)
    assert len(given) > 3
