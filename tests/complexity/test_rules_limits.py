"""Rules with too many markings are refused soon; fewer markings are counted exactly."""

import dataclasses
import time
from contextlib import nullcontext
from itertools import pairwise

import pytest
from plain_rules import TUNNEL

from hierroom import Rules
from hierroom.complexity import analyze, markings
from hierroom.complexity.requirements import goal_depths, relevant_rules
from hierroom.support.errors import InputError


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
