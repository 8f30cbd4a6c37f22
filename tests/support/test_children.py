"""Child processes of tests are started by `children`, with its limit."""

import ast
from pathlib import Path

import pytest
from children import TIMES_QUIET, run_python

TESTS = Path(__file__).parents[1]
LIMITED = {"run", "check_output", "check_call", "call"}


def limits(source):
    """Return the calls of `subprocess` that wait for an end, and numbers that limit a time."""
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    for call in calls:
        if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) == "subprocess" and call.func.attr in LIMITED:
            yield ast.unparse(call)
        yield from (f"{ast.unparse(call.func)}(timeout={ast.unparse(word.value)})" for word in call.keywords
                    if word.arg == "timeout" and isinstance(word.value, ast.Constant))


def test_no_test_has_a_limit_of_its_own():
    found = {path.relative_to(TESTS).as_posix(): list(limits(path.read_text())) for path in TESTS.rglob("*.py")}
    assert {name: calls for name, calls in found.items() if calls and name != "children.py"} == {}


def test_a_child_has_ten_times_its_quiet_time():
    with pytest.raises(Exception, match=f"timed out after {TIMES_QUIET * 0.01} seconds"):
        run_python("-c", "import time; time.sleep(60)", quiet_seconds=0.01)
