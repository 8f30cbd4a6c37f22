"""The short forms of the fuzzers, with seeds that do not change."""

import pytest

from . import apis, checkpoints, command_lines, configs, metrics, toml_files
from .commands import problems

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", apis.APIS)
def test_fuzzed_invalid_uses_raise_one_line_errors(name):
    assert [one for one in apis.problems(name, 60, 20) if one[1] is not None] == []


@pytest.mark.parametrize(("fuzzer", "count"), [(command_lines, 60), (configs, 60), (toml_files, 60), (metrics, 25)])
def test_fuzzed_input_ends_in_one_line(fuzzer, count, tmp_path):
    assert [one for one in problems(fuzzer.attempts, count, 20, tmp_path) if one[1] is not None] == []


@pytest.mark.parametrize("name", checkpoints.CONFIGS)
def test_damaged_files_never_load_and_crafted_states_do_no_harm(name):
    config = checkpoints.CONFIGS[name]
    state = checkpoints.trained_state(config, updates=3)
    assert checkpoints.try_damaged(checkpoints.to_bytes(state), 60, seed=0) == 60
    assert 0 < checkpoints.try_crafted(config, state, 40, seed=0) < 40
