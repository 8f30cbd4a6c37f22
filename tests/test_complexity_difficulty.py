"""Goal graphs by difficulty, the curriculum over them, and from which of them training samples its levels."""

import numpy as np
import pytest

from hierroom.complexity import Curriculum, Difficulty, analyze, is_difficulty, parse_difficulty
from hierroom.complexity.difficulty import EPISODES_PER_STAGE, GraphSampler
from hierroom.errors import InputError
from hierroom.goals import NAMED_GRAPHS, enumerate_graphs

N_ENVS = 8


def test_every_graph_in_the_interval_and_no_other():
    everything = [graph for n_rooms in range(2, 6) for graph in enumerate_graphs(n_rooms)]
    expected = {graph for graph in everything if 20 <= analyze(graph).hitting_time <= 30}
    found = Difficulty(20, 30, max_rooms=5).graphs
    assert set(found) == expected
    assert NAMED_GRAPHS["g"].canonical() in expected
    values = [analyze(graph).hitting_time for graph in found]
    assert values == sorted(values)


@pytest.mark.parametrize("drop_key", [False, True])
def test_samples_lie_in_the_interval_and_cover_it(drop_key):
    interval = parse_difficulty("expected_steps:100..150", drop_key, max_rooms=4)
    rng = np.random.default_rng(0)
    drawn = {interval.sample(rng) for _ in range(300)}
    assert drawn == set(interval.graphs)
    assert all(100 <= analyze(graph, drop_key).expected_steps <= 150 for graph in drawn)


def test_the_same_generator_draws_the_same_graphs():
    interval = parse_difficulty("hitting_time:20..30", max_rooms=5)
    draws = [[interval.sample(rng) for _ in range(5)] for rng in map(np.random.default_rng, (4, 4))]
    assert draws[0] == draws[1]


def test_stages_hold_every_graph_once_and_get_harder():
    curriculum = Curriculum(Difficulty(8, 90, max_rooms=5), n_stages=7)
    assert sorted(sum((stage.graphs for stage in curriculum.stages), ()), key=repr) == sorted(
        curriculum.difficulty.graphs, key=repr
    )
    assert len(curriculum.stages) < 7  # no graph of five rooms is harder than 47: the last stages are left out
    for easier, harder in zip(curriculum.stages, curriculum.stages[1:], strict=False):
        assert easier.high < harder.low


def test_an_interval_of_one_value_is_one_stage():
    value = analyze("g").hitting_time
    stages = Curriculum(Difficulty(value, value, max_rooms=4), n_stages=5).stages
    assert [stage.graphs for stage in stages] == [(NAMED_GRAPHS["g"],)]


def test_advancing():
    curriculum = Curriculum(Difficulty(8, 50, max_rooms=5), n_stages=3, promote_at=0.8, demote_at=0.2)
    assert [curriculum.advance(0, rate) for rate in (0.0, 0.5, 0.8, 1.0)] == [0, 0, 1, 1]
    assert [curriculum.advance(1, rate) for rate in (0.0, 0.19, 0.2, 0.79, 0.8)] == [0, 0, 1, 1, 2]
    assert curriculum.advance(2, 1.0) == 2


def test_what_is_a_difficulty():
    assert [is_difficulty(spec) for spec in ("hitting_time:1..2", "expected_steps:x", "c", "rooms.toml")] == [
        True,
        True,
        False,
        False,
    ]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: parse_difficulty("hitting_time:20-30"),
            "must be hitting_time:LOW..HIGH or .*not 'hitting_time:20-30'",
        ),
        (lambda: parse_difficulty("width:1..2"), "a difficulty must be"),
        (lambda: parse_difficulty("hitting_time:-3..2"), "a difficulty must be"),
        (lambda: parse_difficulty("hitting_time:30..20"), "from low to high, not from 30 to 20"),
        (
            lambda: parse_difficulty("hitting_time:1..2"),
            r"up to 7 rooms has a hitting_time in 1\.\.2; the values go from 8.36",
        ),
        (lambda: Difficulty(1, 100, "depth"), "measured by hitting_time or expected_steps, not depth"),
        (lambda: Difficulty(1, 100, max_rooms=8), "max_rooms must be from 2 to 7, not 8"),
        (lambda: Curriculum(Difficulty(8, 9), n_stages=0), "at least one stage"),
        (lambda: Curriculum(Difficulty(8, 9), promote_at=0.1), "demote_at < promote_at"),
        (lambda: Curriculum(Difficulty(8, 9)).advance(5, 0.5), "there is no stage 5"),
        (lambda: Curriculum(Difficulty(8, 9)).advance(0, 1.5), "a success rate must be in 0..1"),
    ],
)
def test_one_clear_message(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def end(sampler, is_escape, envs=range(N_ENVS)):
    """A step that ends the episodes of some environments."""
    ended = np.isin(np.arange(N_ENVS), envs)
    return sampler.add(ended, ended & is_escape)


def test_episodes_that_began_in_another_stage_say_nothing_of_this_one():
    sampler = GraphSampler("hitting_time:8..50", False, N_ENVS, n_stages=3)
    first = sampler.graphs
    moves = [end(sampler, True) for _ in range(EPISODES_PER_STAGE // N_ENVS)]
    assert moves == [False] * (len(moves) - 1) + [True]
    second = sampler.graphs
    assert second != first
    assert not end(sampler, True, [0, 1])  # begun in the first stage, as the six below
    for _ in range((EPISODES_PER_STAGE - 2) // 2):
        assert not end(sampler, False, [0, 1])
    again = GraphSampler("hitting_time:8..50", False, N_ENVS, n_stages=3)
    again.set_state(sampler.get_state())
    for each in (sampler, again):
        assert not end(each, True, range(2, N_ENVS))
        assert each.graphs == second
        assert end(each, False, [2, 3])  # 200 of this stage, none of them an escape
        assert each.graphs == first


def test_one_graph_has_no_stages():
    sampler = GraphSampler("c", False, N_ENVS)
    assert not any(end(sampler, True) for _ in range(EPISODES_PER_STAGE))
    assert sampler.graphs == sampler.everything
