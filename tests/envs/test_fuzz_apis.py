"""A short run of the fuzzer of the APIs."""

import pytest
from fuzz import apis


@pytest.mark.slow
@pytest.mark.parametrize("name", apis.APIS)
def test_fuzzed_invalid_uses_raise_one_line_errors(name):
    wrong = [(tried, problem) for tried, problem in apis.problems(name, 60, 20) if problem is not None]
    assert wrong == []
