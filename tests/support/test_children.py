"""Child processes of tests are started by `children`, with its limit."""

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parents[1]


def limits(source: str) -> Iterator[str]:
    """Find calls of `subprocess` that wait for a child's end, and limits that are numbers."""
    for call in ast.walk(ast.parse(source)):
        if isinstance(call, ast.Call):
            name = ast.unparse(call.func)
            words = {word.arg: word.value for word in call.keywords}
            if name in ("subprocess.run", "subprocess.check_output", "subprocess.check_call"):
                yield name
            elif isinstance(words.get("timeout"), ast.Constant) or (
                name.endswith((".wait", ".join"))
                and any(isinstance(one, ast.Constant) and isinstance(one.value, int | float) for one in call.args)
            ):
                yield ast.unparse(call)


def test_no_test_sets_a_separate_time_limit():
    found = {path.relative_to(TESTS).as_posix(): [*limits(path.read_text())] for path in TESTS.rglob("*.py")}
    assert {name: calls for name, calls in found.items() if calls and name != "children.py"} == {}
