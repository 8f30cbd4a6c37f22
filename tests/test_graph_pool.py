"""Which goal graphs training draws its levels from."""

from types import SimpleNamespace

import numpy as np

from hierroom.complexity.graph_sampler import EPISODES_PER_STAGE, GraphSampler

N_ROOMS = 8


def end(pool, is_escape, rooms=range(N_ROOMS)):
    """A step that ends the episodes of some rooms."""
    episode_ended = np.isin(np.arange(N_ROOMS), rooms)
    return pool.add(SimpleNamespace(episode_ended=episode_ended, terminated=episode_ended & is_escape))


def test_episodes_that_began_in_another_stage_say_nothing_of_this_one():
    pool = GraphSampler("hitting_time:8..50", False, N_ROOMS, n_stages=3)
    first = pool.graphs
    moves = [end(pool, True) for _ in range(EPISODES_PER_STAGE // N_ROOMS)]
    assert moves == [False] * (len(moves) - 1) + [True]
    second = pool.graphs
    assert second != first
    assert not end(pool, True, [0, 1])  # begun in the first stage, as the six below
    for _ in range((EPISODES_PER_STAGE - 2) // 2):
        assert not end(pool, False, [0, 1])
    again = GraphSampler("hitting_time:8..50", False, N_ROOMS, n_stages=3)
    again.load_state_dict(pool.state_dict())
    for each in (pool, again):
        assert not end(each, True, range(2, N_ROOMS))
        assert each.graphs == second
        assert end(each, False, [2, 3])  # 200 of this stage, none of them an escape
        assert each.graphs == first


def test_one_graph_has_no_stages():
    pool = GraphSampler("c", False, N_ROOMS)
    assert not any(end(pool, True) for _ in range(EPISODES_PER_STAGE))
    assert pool.graphs == pool.everything
