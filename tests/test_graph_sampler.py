"""Which goal graphs training uniforms its levels from."""

import numpy as np

from hierroom.complexity.graph_sampler import EPISODES_PER_STAGE, GraphSampler

N_ENVS = 8


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
