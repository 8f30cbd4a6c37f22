"""The short form of `tests/fuzz/checkpoints.py`, with a seed that does not change."""

import pytest
from fuzz import checkpoints


@pytest.mark.slow
@pytest.mark.parametrize("name", checkpoints.CONFIGS)
def test_damaged_files_never_load_and_crafted_states_do_no_harm(name):
    config = checkpoints.CONFIGS[name]
    state = checkpoints.trained_state(config, updates=3)
    assert checkpoints.try_damaged(checkpoints.to_bytes(state), 60, seed=0) == 60
    assert 0 < checkpoints.try_crafted(config, state, 40, seed=0) < 40
