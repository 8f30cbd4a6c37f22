"""The curriculum over a set of goal graphs, and from which of them training samples its levels."""

import numpy as np
import pytest

from hierroom.complexity import Curriculum, GraphSet
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.graph_sampler import EPISODES_PER_STAGE, GraphSampler
from hierroom.worlds.escape_room.layout import LEVEL

EASY = GraphSet("rooms:3")
N_ENVS = 8


def test_curriculum_promotes_and_demotes_by_success_rate():
    curriculum = Curriculum(GraphSet("hitting_time:8..50"), n_stages=3, promote_at=0.8, demote_at=0.2)
    assert [curriculum.advance(0, rate) for rate in (0.0, 0.5, 0.8, 1.0)] == [0, 0, 1, 1]
    assert [curriculum.advance(1, rate) for rate in (0.0, 0.19, 0.2, 0.79, 0.8)] == [0, 0, 1, 1, 2]
    assert curriculum.advance(2, 1.0) == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Curriculum(EASY, n_stages=0), "the number of stages must be at least 1, not 0"),
        (lambda: Curriculum(EASY, n_stages=2.5), "the number of stages must be a whole number, not 2.5"),
        (lambda: Curriculum(EASY, promote_at=0.1), "demote_at < promote_at"),
        (lambda: Curriculum(EASY).advance(5, 0.5), "there is no stage 5"),
        (lambda: Curriculum(EASY).advance(0, 1.5), "a success rate must be in 0..1"),
        (lambda: GraphSampler("g", (), False, 2, n_stages=3), "of 3 stages needs several graphs.*not g alone"),
    ],
)
def test_invalid_curriculum_raises_input_error(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def end(sampler, is_escape, envs=range(N_ENVS)):
    ended = np.isin(np.arange(N_ENVS), envs)
    return sampler.add(ended, ended & is_escape)


def test_episodes_begun_in_another_stage_do_not_count():
    sampler = GraphSampler("hitting_time:8..50", (), False, N_ENVS, n_stages=3)
    first, quota = sampler.graphs, EPISODES_PER_STAGE // N_ENVS
    moves = [end(sampler, True) for _ in range(quota)]
    assert moves == [False] * (len(moves) - 1) + [True]
    second = sampler.graphs
    assert second != first
    assert not end(sampler, True, [0, 1])  # begun in the first stage, as the six below
    for _ in range(quota):
        assert not end(sampler, False, [0, 1])
    again = GraphSampler("hitting_time:8..50", (), False, N_ENVS, n_stages=3)
    again.set_state(sampler.get_state(), np.zeros(0, LEVEL))
    for each in (sampler, again):
        assert not end(each, True, range(2, N_ENVS))
        for _ in range(quota - 1):
            assert not end(each, False, range(2, N_ENVS))
        assert each.graphs == second
        assert end(each, False, range(2, N_ENVS))  # 200 of this stage, none of them an escape
        assert each.graphs == first


@pytest.mark.parametrize("n_envs", [16, 64, 256])
def test_short_episodes_count_no_more_than_long_ones(n_envs):
    """An agent that escapes in 70% of episodes, after 6 steps, and else fails after 100, is not promoted at 80%."""
    sampler, random = GraphSampler("hitting_time:8..50", (), False, n_envs, n_stages=3), np.random.default_rng(0)
    escapes, age = random.random(n_envs) < 0.7, random.integers(0, 6, n_envs)
    for _ in range(4000):
        age += 1
        ended = age == np.where(escapes, 6, 100)
        assert not sampler.add(ended, ended & escapes)
        escapes, age = np.where(ended, random.random(n_envs) < 0.7, escapes), np.where(ended, 0, age)


def test_episodes_beyond_an_environments_share_do_not_count():
    sampler = GraphSampler("hitting_time:8..50", (), False, N_ENVS, n_stages=3)
    quota = EPISODES_PER_STAGE // N_ENVS
    for _ in range(10 * quota):
        assert not end(sampler, True, [0])
    moves = [end(sampler, False, range(1, N_ENVS)) for _ in range(quota)]
    assert not any(moves)  # 25 of 200, and not below a fifth were the others counted
    assert sampler.get_state()["curriculum"].tolist() == [0, 0]
    assert sampler.get_state()["n_ended"].tolist() == [-1] * N_ENVS


def test_one_graph_has_no_stages():
    sampler = GraphSampler("c", (), False, N_ENVS)
    assert not any(end(sampler, True) for _ in range(EPISODES_PER_STAGE))
    assert sampler.graphs == sampler.everything
