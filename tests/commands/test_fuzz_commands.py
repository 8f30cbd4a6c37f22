"""The short forms of the fuzzers of command lines, config.json, TOML files and tables, each with one seed."""

import pytest
from fuzz import command_lines, configs, metrics, toml_files
from fuzz.commands import problems


@pytest.mark.slow
@pytest.mark.parametrize(("fuzzer", "count"), [(command_lines, 60), (configs, 60), (toml_files, 60), (metrics, 25)])
def test_fuzzed_input_ends_in_one_line(fuzzer, count, tmp_path):
    wrong = [
        (tried, problem) for tried, problem in problems(fuzzer.attempts, count, 20, tmp_path) if problem is not None
    ]
    assert wrong == []
