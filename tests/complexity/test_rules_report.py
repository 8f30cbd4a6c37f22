"""Rules: the marking chain against numbers worked by hand, plain Python and play; depths and dead ends."""

import json
import math
import pickle

import numpy as np
import pytest
from plain_rules import TUNNEL, matrix, random_rules, unroll
from scipy.stats import spearmanr

from hierroom import Rules, enumerate_graphs
from hierroom.commands import complexity as command
from hierroom.complexity import Chain, Walk, analyze
from hierroom.complexity.requirements import goal_depths
from hierroom.support.errors import InputError
from hierroom.support.files import to_json

LIFE = Rules(
    {
        "pick": {"needs": "life", "gives": "key"},
        "find": {"needs": "life", "gives": "key"},
        "sell": {"uses": "life", "gives": "key"},
        "leave": {"needs": ["key", "life"], "gives": "out"},
        "dance": {"uses": "key", "gives": "joy"},
    },
    target="out",
    start={"life": 1},
)
WATER = Rules(
    {
        "melt": {"uses": "ice", "gives": "water"},
        "freeze": {"uses": "water", "gives": "ice"},
        "drink": {"needs": "water", "gives": "well"},
    },
    target="well",
    start={"water": 1},
)


def test_marking_chain_by_hand():
    """Nodes S = {life}, A = {life, key}, D = {key} and the target T; 'dance' is left out.

    S leads to A twice (pick, find) and to D once (sell); A leads to D (sell: the life is used) and to T; D and T have
    only the restart. Expected visits v before T: 0.095 v_A = 1, so v_A = 10.526; 0.2 v_A = (0.38 / 3) v_S, so
    v_S = 16.620; and 0.01 v_D = (0.19 / 3) v_S + 0.095 v_A, so v_D = 205.263. They sum to 232.410 steps. With r = 0.01
    the hitting time is (v_S + r |v|^2) / (1 + r^2 |v|^2), as the target has only its restart.
    """
    report = analyze(LIFE)
    assert report.chain.labels == ("start", "key 1", "life 1, key 1", "out")
    a, b = 0.19 / 3, 0.19 / 2
    np.testing.assert_allclose(
        report.chain.weights.toarray(), [[0, a, 2 * a, 0], [0.01, 0, 0, 0], [0.01, b, 0, b], [0.01, 0, 0, 0]]
    )
    visits = np.array([16.62049861, 205.26315789, 10.52631579])
    assert report.expected_steps == pytest.approx(visits.sum())
    squares = (visits**2).sum()
    assert report.hitting_time == pytest.approx((visits[0] + 0.01 * squares) / (1 + 0.0001 * squares))
    assert (report.nodes, report.edges, report.fewest, report.exit_depth, report.width) == (4, 5, 2, 1, 3)
    assert (report.dead_ends, report.dead_end_share, report.left_out, report.never) == (
        ("key 1",),
        1 / 3,
        ("dance",),
        (),
    )
    assert report.reach_probability(1) == 0
    assert report.reach_probability(2) == pytest.approx(2 * a * b)
    assert report.expected_steps_to("key") == pytest.approx(1 / 0.19)
    assert report.expected_steps_to("out") == report.expected_steps_to("exit") == report.expected_steps


@pytest.mark.parametrize("seed", range(30))
def test_marking_chain_equals_plain_python(seed):
    rules = random_rules(seed)
    report, moves = analyze(rules), unroll(rules)
    weights = matrix(moves)
    nodes = {node: i for i, node in enumerate(moves)}
    unrolled = report.unrolled
    order = [
        nodes[frozenset((fact, n) for fact, n in zip(unrolled.facts, marking, strict=True) if n)]
        for marking in unrolled.markings.tolist()
    ] + [len(moves) - 1]
    np.testing.assert_allclose(report.chain.weights.toarray(), weights[np.ix_(order, order)], atol=1e-15)
    back = {node: [other for other in moves if node in moves[other]] for node in moves}
    alive, distance, layer = {rules.target}, {next(iter(moves)): 0}, [rules.target]
    while layer:
        layer = [one for node in layer for one in back[node] if one not in alive]
        alive |= {*layer}
    for node in (queue := [*distance]):
        queue += [to for to in dict.fromkeys(moves[node]) if to not in distance]
        distance |= {to: distance[node] + 1 for to in moves[node] if to not in distance}
    assert len(report.dead_ends) == len(moves) - len(alive)
    assert report.fewest == distance.get(rules.target, math.inf)
    if math.isinf(report.fewest):
        assert report.expected_steps == report.hitting_time == report.exit_depth == math.inf
        assert report.reach_probability(10**6) == 0
        return
    laplacian = np.diag(weights.sum(axis=1)) - weights
    assert report.expected_steps == pytest.approx(np.linalg.solve(laplacian[:-1, :-1], np.ones(len(moves) - 1))[0])
    b = np.eye(len(moves))[0] - np.eye(len(moves))[-1]
    assert report.hitting_time == pytest.approx(b @ np.linalg.pinv(laplacian) @ b)
    assert sum(report.goal_sensitivity().values()) <= 1e-9
    assert report.exit_depth + 1 <= report.fewest


def test_depth_width_and_fewest_by_hand():
    assert goal_depths(TUNNEL) == {"wood": 1, "table": 2, "pickaxe": 3, "stone": 4, "tunnel": 5}
    report = analyze(TUNNEL)
    assert (report.exit_depth, report.width, report.fewest) == (4, 1, 9)  # 3 wood, table, pickaxe, 3 stone, tunnel
    assert goal_depths(WATER) == {"melt": 2, "freeze": 1, "drink": 1}
    assert (analyze(WATER).exit_depth, analyze(WATER).fewest) == (0, 1)
    either = {"a": {"gives": "a"}, "b": {"needs": "a", "gives": "b"}, "c": {"gives": "c"}, "d": {"gives": "d"}}
    ways = [{"needs": "b", "gives": "t"}, {"needs": ["c", "d"], "gives": "t"}]
    either = analyze(Rules({**either, "t": ways}, "t"))
    assert (either.exit_depth, either.width, either.fewest) == (1, 3, 3)  # by c and d, or by a and b


def test_goal_sensitivity_equals_numerical_slope():
    """By the definition: W of all edges of a goal 0.01% larger, and the mean of that walk."""
    report = analyze(TUNNEL)
    goal, change = next(iter(report.goal_sensitivity().items()))
    assert goal == "stone"
    unrolled, n = report.unrolled, report.nodes
    chances = 0.19 / np.bincount(unrolled.edges[:, 0], minlength=n)[unrolled.edges[:, 0]]
    easier = report.chain.weights.toarray()
    own = unrolled.edge_goals == unrolled.goals.index(goal)
    np.add.at(easier, tuple(unrolled.edges[own].T), 1e-4 * chances[own])
    steps = Chain.from_matrix(easier, 0, n - 1).expected_steps
    assert (steps / report.expected_steps - 1) / 1e-4 == pytest.approx(change, rel=1e-3)


GRAPHS = [graph for n in range(2, 6) for graph in enumerate_graphs(n)]


def test_rules_rank_goal_graphs_like_augmented_graphs():
    assert len(GRAPHS) == 39
    of_graphs, of_rules = ([analyze(one) for one in of] for of in (GRAPHS, [graph.rules() for graph in GRAPHS]))
    ranks = spearmanr([one.hitting_time for one in of_graphs], [one.hitting_time for one in of_rules])
    assert round(float(ranks[0]), 2) == 0.96
    for graph, rules in zip(of_graphs, of_rules, strict=True):
        assert (rules.name, rules.exit_depth, rules.width) == (graph.name, graph.exit_depth, graph.width)
        assert rules.fewest == graph.exit_depth + 1
        assert rules.left_out == rules.never == rules.dead_ends == ()


def test_unreachable_target_is_infinite_and_explained():
    report = analyze(Rules({"a": {"needs": "b", "gives": "c"}, "x": {"gives": "y"}}, "c"))
    assert (report.expected_steps, report.hitting_time, report.fewest, report.exit_depth) == (math.inf,) * 4
    assert "out of reach    a   (what they need is never there)" in str(report)
    assert "left out        x" in str(report)
    nothing = analyze(Rules({"a": {"gives": "c"}, "x": {"needs": "z", "gives": "y"}}, "z"))
    assert (nothing.nodes, nothing.edges, nothing.expected_steps, nothing.left_out) == (2, 0, math.inf, ("a", "x"))
    for one in (report, nothing):
        assert json.loads(to_json(one.to_dict()))["expected_steps"] is None


def test_report_lists_capacities_dead_ends_and_unused_rules():
    text = str(analyze(LIFE))
    for line in (
        "rules: 5 rules, target out",
        "left out        dance   (they do not help to get out)",
        "capacity        1 of every fact",
        "start           life 1",
        "fewest          2   (goals to achieve, the last gives out)",
        "dead ends       1 of 3 markings (33.3%): key 1",
    ):
        assert line in text
    assert "capacity        wood 3, stone 3; 1 of every other fact" in str(analyze(TUNNEL))
    assert "hitting time    nan   (it needs a walk that returns" in str(analyze(TUNNEL, walk=Walk(0.8, 0.2, 0.0)))


def test_rules_report_in_every_format(tmp_path):
    report = analyze(TUNNEL)
    plain = json.loads(to_json(report.to_dict()))
    assert plain["hitting_time"] == report.hitting_time
    assert plain["goals"]["tunnel"] == 5
    assert plain["capacity"] == {"wood": 3, "table": 1, "pickaxe": 1, "stone": 3, "way": 1, "dynamite": 1}
    assert "dead ends" in report._repr_html_()
    assert report == analyze(TUNNEL)
    assert pickle.loads(pickle.dumps(report)).expected_steps == report.expected_steps
    for one in (report, analyze(LIFE)):
        one.draw(tmp_path / "picture.svg")
        assert (tmp_path / "picture.svg").read_text().count("</svg>") == one._repr_svg_().count("</svg>") == 1


def test_analyze_refuses_chains_and_walks_of_other_forms():
    for subject in (3, analyze("c").chain):
        with pytest.raises(InputError, match=r"analyze takes a goal graph or rules, such as task\.rules, not"):
            analyze(subject)
    with pytest.raises(InputError, match="a walk must be a Walk of three probabilities, not 3"):
        analyze("c", walk=3)
    with pytest.raises(InputError, match="drop_key is of goal graphs"):
        analyze(TUNNEL, drop_key=True)


def test_rules_option_takes_toml_files(tmp_path, capsys):
    path, other = tmp_path / "tunnel.toml", tmp_path / "life.toml"
    TUNNEL.to_toml(path)
    LIFE.to_toml(other)
    assert command.main(["--rules", str(path)]) == 0
    assert capsys.readouterr().out.strip() == str(analyze(TUNNEL))
    command.main(["--rules", str(path), "--json", "--draw", str(tmp_path / "a.svg")])
    assert json.loads(capsys.readouterr().out)["hitting_time"] == analyze(TUNNEL).hitting_time
    assert (tmp_path / "a.svg").stat().st_size > 1000
    command.main(["--rules", str(path), str(other), "--csv"])
    assert [line.split(",")[3] for line in capsys.readouterr().out.splitlines()] == ["graph", "tunnel", "life"]
    command.main(["--rules", str(path), str(other)])
    assert "2 sets of rules" in capsys.readouterr().out
    with pytest.raises(InputError, match="cannot read the rules"):
        command.main(["--rules", "nowhere.toml"])


def test_exit_depth_counts_only_alternatives_that_give_the_target():
    forge = [{"needs": "ore", "gives": "slag"}, {"needs": "pick", "gives": "blade"}]
    rules = Rules(
        {
            "ore": {"needs": "slag", "gives": "ore"},
            "wood": {"gives": "wood"},
            "handle": {"needs": "wood", "gives": "handle"},
            "pick": {"needs": "handle", "gives": "pick"},
            "forge": [*forge, {"gives": "ash"}],
        },
        target="blade",
    )
    report = analyze(rules)
    assert report.goal_depths["forge"] == 1  # it gives ash without any other goal
    assert (report.fewest, report.exit_depth) == (4, 3)
