"""Random numbers of the episodes of a simple world."""

import numpy as np

from hierroom.worlds.base_view import episode_states
from hierroom.worlds.task.replayer import seeds_of


def test_states_are_those_of_numpys_seed_sequence():
    bits = np.random.default_rng(0).integers(1, 63, (200, 5))
    rows = np.random.default_rng(1).integers(0, 1 << bits)
    found = episode_states(rows[:, :3], 6, 2, rows[:, 3], rows[:, 4])
    for (*episode, turn, other), states in zip(rows.tolist(), found, strict=True):
        assert np.array_equal(np.random.SeedSequence([*episode, 2, turn, other]).generate_state(6, np.uint64), states)
    episodes = [[0, 0, 0], [2**32, 3, 1], [2**63 - 1, 0, 2**32 - 1]]
    seeds = [np.random.SeedSequence([*one, 1, 0]).generate_state(1).item() for one in episodes]
    assert seeds_of(np.array(episodes), "training") == seeds
