"""The short form of the fuzzer of the APIs."""

import pytest
from fuzz import apis


@pytest.mark.slow
@pytest.mark.parametrize("name", apis.APIS)
def test_invalid_uses_end_in_one_line(name):
    wrong = [(tried, problem) for tried, problem in apis.problems(name, 60, 20) if problem is not None]
    assert wrong == []
