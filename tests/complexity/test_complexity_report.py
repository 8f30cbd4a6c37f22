"""Reports of goal graphs and rules: text, numbers, tables and drawings, which are frozen, fast, and limited in size."""

import dataclasses
import json
import pickle
import time
from contextlib import nullcontext
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from plain_rules import TUNNEL

from hierroom import Rules
from hierroom.complexity import analyze, markings, mean_first_passage_time
from hierroom.complexity.requirements import goal_depths, relevant_rules
from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError
from hierroom.support.tables import html_table


def test_to_dict_is_plain_and_agrees_with_the_properties():
    report = analyze("f", drop_key=True)
    plain = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert plain["graph"] == "f"
    assert plain["hitting_time"] == report.hitting_time
    assert plain["expected_steps"] == plain["expected_steps_to"]["exit"] == report.expected_steps
    assert plain["reach_probability"]["1000"] == report.reach_probability(1000)


def test_report_is_frozen_hashable_and_picklable():
    report = analyze("d")
    with pytest.raises(dataclasses.FrozenInstanceError):
        report.drop_key = True  # type: ignore[misc]
    assert report == analyze(NAMED_GRAPHS["d"])
    assert len({report, analyze("d"), analyze("d", drop_key=True)}) == 2
    assert pickle.loads(pickle.dumps(report)).hitting_time == report.hitting_time


def test_expected_steps_grow_along_the_goals():
    report = analyze("g")
    order = ["key 1", "door 1", "key 2", "door 2", "key 3", "door 3", "exit"]
    steps = [report.expected_steps_to(goal) for goal in order]
    assert steps == sorted(steps)
    assert steps[0] == pytest.approx(1 / 0.19)
    # from the start the only way leads over key 1 to room 1: 'door 1' is that node's own passage time
    assert report.expected_steps_to("door 1") == pytest.approx(report.expected_steps_to("room 1, open 1"))


def test_hitting_time_to_needs_a_single_node():
    report = analyze("c")
    assert report.chain.hitting_time_to("exit") == report.hitting_time
    assert 0 < report.chain.hitting_time_to("key 1, all closed") < report.hitting_time
    with pytest.raises(InputError, match="'door 1' is achieved at 6; name one of them"):
        report.chain.hitting_time_to("door 1")
    with pytest.raises(InputError, match=r"the goals are key 1, .* there is no 'key 9'"):
        report.expected_steps_to("key 9")


def test_goal_sensitivity_equals_numerical_slope():
    report = analyze("d")
    goal, change = next(iter(report.goal_sensitivity().items()))
    weights = report.chain.weights.toarray()
    achieved = np.isin(np.arange(report.nodes), report.chain.goals[goal])
    easier = weights * np.where(~achieved[:, None] & achieved[None], 1.0001, 1.0)
    faster = mean_first_passage_time(easier, report.augmented.exit)[0]
    assert (faster / report.expected_steps - 1) / 0.0001 == pytest.approx(change, rel=1e-3)


@pytest.mark.parametrize(("n_rooms", "seconds"), [(7, 1.0), pytest.param(10, 10.0, marks=pytest.mark.slow)])
def test_analyze_is_fast(n_rooms, seconds):
    started = time.process_time()  # not slowed by what else runs
    assert analyze(GoalGraph((0,) * (n_rooms - 1), 1), drop_key=True).to_dict()["nodes"] > 0
    assert time.process_time() - started < seconds


SVG = "{http://www.w3.org/2000/svg}"


def test_goal_graph_is_drawn_unless_it_is_large():
    graph = GoalGraph((0, 0, 1), 3, label="<mine> & $yours$")
    root = ElementTree.fromstring(graph._repr_svg_())
    assert root.tag == f"{SVG}svg"
    assert GoalGraph(tuple(range(2000)), 2000)._repr_svg_() is None


def test_report_html_equals_its_printed_text():
    report = analyze("f")
    shown = ElementTree.fromstring(f"<div>{report._repr_html_()}</div>")
    head, *lines = str(report).splitlines()
    assert shown.find("table/caption").text == head
    rows = [[cell.text or "" for cell in row] for row in shown.iter("tr")]
    notes = [note.text for note in shown.iter("p")]
    assert len(rows) > 5
    for line, cells in zip(lines, [*rows, *([note] for note in notes)], strict=True):
        assert line.split() == " ".join(cells).split()


def test_html_table_escapes_texts():
    table = html_table("<a>", ("b&",), [("<c>", "d<")], ["e>"])
    texts = [text for text in ElementTree.fromstring(f"<div>{table}</div>").itertext() if text]
    assert texts == ["<a>", "b&", "<c>", "d<", "e>"]


def with_capacity(**counts):
    return dataclasses.replace(TUNNEL, capacity=counts)


def many(n):
    facts = [f"f{i}" for i in range(n)]
    return Rules({fact: {"gives": fact} for fact in facts} | {"t": {"needs": facts, "gives": "t"}}, "t")


def pipeline(n):
    facts = [f"f{i}" for i in range(n)]
    rules = {fact: {"uses": before, "gives": fact} for before, fact in pairwise(facts)}
    return Rules({"f0": {"gives": "f0"}, **rules, "t": {"needs": facts, "gives": "t"}}, "t")


def trades(n):
    rules = {f"trade{i}": {"uses": f"old{i}", "gives": f"new{i}"} for i in range(n)}
    new = [f"new{i}" for i in range(n)]
    start = {f"old{i}": 1 for i in range(n)}
    return Rules({**rules, "t": {"uses": dict.fromkeys(new, 2), "gives": "t"}}, "t", dict.fromkeys(new, 2), start)


@pytest.mark.parametrize(
    ("rules", "advice"),
    [
        (with_capacity(stone=10**6, wood=3), r"lower the capacity of stone \(1,000,000\), w"),
        (with_capacity(wood=10**9), r"lower the capacity of wood \(1,000,000,000\), or leave"),
        (many(20), "these 21 rules over 21 facts give more; leave out rules"),
        (many(90), "these 91 rules over 91 facts give more; leave out rules"),
        (pipeline(61), "these 62 rules over 62 facts give more; leave out rules"),
        (trades(800), r"these 801 rules over 1601 facts give more; lower the capacity of new99 \(2\)"),
    ],
)
def test_too_many_markings_raise_input_error_within_a_second(rules, advice):
    started = time.process_time()  # not slowed by what else runs
    with pytest.raises(InputError, match=f"at most 100,000 markings, .*{advice}") as caught:
        analyze(rules)
    assert time.process_time() - started < 1
    assert "\n" not in str(caught.value)


def chain(names):
    return Rules({new: {"needs": old, "gives": new} if old else {"gives": new} for old, new in names}, "last")


def test_long_chains_are_read_in_linear_time_and_refused_by_their_size():
    """Each goal was once looked for in all rules: 20,000 goals took 170 seconds."""
    names = [*pairwise([None, *(f"f{n}" for n in range(2000)), "last"])]
    started = time.process_time()
    assert goal_depths(chain(names[::-1]))["last"] == 2001
    assert relevant_rules(chain(names)) == chain(names)
    assert time.process_time() - started < 2
    with pytest.raises(InputError, match=r"6,001 rules times 1 alternatives times 6,001 facts are 36,012,001, and at"):
        analyze(chain([*pairwise([None, *(f"f{n}" for n in range(6000)), "last"])]))


def test_many_counts_and_facts_give_exact_markings():
    counter = Rules({"a": {"gives": "a"}, "t": {"needs": {"a": 5}, "gives": "t"}}, "t", {"a": 5})
    assert analyze(dataclasses.replace(counter, capacity={"a": 300})).nodes == 302
    wide = Rules(  # 80 facts that can be 1 to 3 give more markings than 63 bits number, but only 3 * 79 + 2 are reached
        {f"f{i}": {"needs": f"f{i - 1}" if i else [], "gives": f"f{i}"} for i in range(80)}
        | {"t": {"needs": "f79", "gives": "t"}},
        "t",
        {"f79": 3},
    )
    assert analyze(wide).nodes == 80 + 3 + 1


@pytest.mark.parametrize(("limit", "is_refused"), [(302, False), (301, True)])
def test_rules_with_as_many_nodes_as_the_limit_are_analyzed(limit, is_refused, monkeypatch):
    monkeypatch.setattr(markings, "MAX_NODES", limit)
    counter = Rules({"a": {"gives": "a"}, "t": {"needs": {"a": 5}, "gives": "t"}}, "t", {"a": 300})
    with pytest.raises(InputError, match="at most 301 markings") if is_refused else nullcontext():
        assert analyze(counter).nodes == 302
