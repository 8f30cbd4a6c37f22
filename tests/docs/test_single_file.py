"""Algorithm 1 in one file: its length, what it imports, and what it learns."""

import ast
import sys
from argparse import Namespace
from pathlib import Path

import pytest
import torch
from children import run_python

from hierroom.turns.records import CONTROLLER, META

EXAMPLES = Path(__file__).parents[2] / "examples"
FILE = EXAMPLES / "single_file.py"


@pytest.fixture
def single_file(monkeypatch, one_thread):
    monkeypatch.syspath_prepend(EXAMPLES)
    import single_file

    with torch.random.fork_rng(devices=[]):
        yield single_file


def settings(**others):
    return Namespace(**({"meta": "learned", "graph": "c", "steps": 600_000, "seed": 0} | others))


def test_single_file_has_at_most_300_lines():
    assert len(FILE.read_text().splitlines()) <= 300


def test_single_file_imports_no_learner():
    imports = [node for node in ast.walk(ast.parse(FILE.read_text())) if isinstance(node, ast.ImportFrom | ast.Import)]
    names = {getattr(node, "module", None) or node.names[0].name for node in imports}
    others = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
    assert others == {"hierroom", "numpy", "torch"}
    code = "import sys, single_file; print([n for n in sys.modules if n.startswith('hierroom.')])"
    loaded = ast.literal_eval(run_python("-c", code, cwd=EXAMPLES).stdout)
    assert "hierroom.turns.turns" in loaded
    assert not [name for name in loaded if name.startswith(("hierroom.learners", "hierroom.runs"))]


@pytest.mark.slow
def test_both_agents_learn_to_escape(single_file):
    few, many = settings(graph="a", steps=64), settings(graph="a", steps=200_000)
    untrained, trained = single_file.train(few), single_file.train(many)
    success, length = single_file.evaluate(many, trained)
    assert success >= 0.95
    for name in (META, CONTROLLER):
        _, without = single_file.evaluate(many, {**trained, name: untrained[name]})
        assert without > 1.2 * length, name
