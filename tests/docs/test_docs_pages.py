"""The docs are correct: their Python runs, their commands parse, and their files can be read."""

import argparse
import ast
import json
import math
import re
import runpy
import shlex
import sys
import tempfile
import tomllib
from contextlib import nullcontext
from functools import partial
from itertools import pairwise
from types import ModuleType

import pytest
import tyro
from doc_pages import BLOCKS, PAGES, ROOT, commands, lines_of

import hierroom
from hierroom.commands.complexity import main as complexity
from hierroom.lab.sweep.plan import read_plan
from hierroom.runs.folder.config_file import read_config

OTHERS = sorted({one for found in commands().values() for one in found if not one.startswith("python -m hierroom")})
"""Commands other than the package's, which test_docs_commands.py runs."""
PYTHON = [block for block in BLOCKS if block.language == "python" and block.page != "architecture.md"]
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


class Understood(BaseException):
    """Raised in the place of what a command does once its options are read."""


class Mlflow(ModuleType):
    """A stand-in with the parts of ``mlflow`` that the docs use."""

    def __init__(self):
        super().__init__("mlflow")
        self.params, self.steps = {}, []
        self.start_run = lambda *, run_name: nullcontext()
        self.log_params = self.params.update

    def log_metrics(self, metrics, *, step):
        assert all(math.isfinite(value) for value in metrics.values())
        self.steps.append(step)


def python_block(n, block):
    return pytest.param(block, id=f"{block.page}-{n}", marks=[pytest.mark.slow] * ("train(" in block.text))


@pytest.mark.parametrize("block", [python_block(n, block) for n, block in enumerate(PYTHON)])
def test_python_blocks_run(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(ROOT / "examples")
    mlflow = Mlflow()
    monkeypatch.setitem(sys.modules, "mlflow", mlflow)
    exec(compile(block.text, block.page, "exec"), {"__name__": "page"})
    if "import mlflow" in block.text:
        assert (mlflow.params["graph"], mlflow.steps[-1]) == ("a", 4096)


def test_shown_loop_equals_the_trainers_code():
    shown = next(block.text for block in BLOCKS if block.page == "architecture.md" and block.language == "python")
    source = (ROOT / "hierroom" / "runs" / "trainer.py").read_text()

    def code(text):
        return [line.split("  #")[0].strip() for line in text.splitlines() if line.strip()]

    lines = code(source)
    at = lines.index(code(shown)[0])
    assert lines[at : at + len(code(shown))] == code(shown)


@pytest.mark.parametrize("block", [b for b in BLOCKS if b.language == "toml"], ids=lambda block: block.page)
def test_toml_blocks_are_valid_graphs_plans_or_configs(block, tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(block.text)
    entries = tomllib.loads(block.text)
    if "key_rooms" in entries:
        assert hierroom.env(graph=path).unwrapped.complexity.expected_steps > 0
    elif "seeds" in entries:
        assert len(read_plan(path, []).runs()) > 1
    else:
        assert read_config(path).steps > 0


@pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")
@pytest.mark.parametrize("command", OTHERS)
def test_commands_name_existing_targets_tests_and_options(command, monkeypatch):
    program, *words = shlex.split(command)
    if program == "make":
        assert set(words) <= TARGETS
    elif program == "pytest":
        at = words.index("-k") if "-k" in words else len(words)
        sources = [(ROOT / file).read_text() for file in words[:at]]
        tests = [" ".join(re.findall(r"^def (test_\w+)\(", source, re.MULTILINE)) for source in sources]
        assert all(tests)
        for name in " ".join(words[at + 1 :]).split(" or "):
            assert name in " ".join(tests), name
    elif program == "mkdocs":
        assert words[0] == "build"
    elif program == "pip":
        assert words[0] in ("install", "check")
    elif words != ["-m"]:  # `python -m` as such
        monkeypatch.syspath_prepend(ROOT)  # for tests.fuzz and benchmarks
        monkeypatch.chdir(ROOT)
        _read_options(words, monkeypatch)


def _read_options(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    if words[0] == "-m":
        start, (name, *words) = partial(runpy.run_module, alter_sys=True), words[1:]
        path = ROOT / f"{name.replace('.', '/')}.py"
        path = path if path.is_file() else path.with_suffix("") / "__main__.py"
    else:
        start, (name, *words) = runpy.run_path, words
        path = ROOT / name
    assert path.is_file()
    if not words or not re.search(r"\btyro\b|\bargparse\b|import .*\breport\b", path.read_text()):
        assert not words, f"{path.name} takes no options"
        return
    monkeypatch.setattr(sys, "argv", [str(path), *words])
    for module, function in ((tyro, "cli"), (argparse.ArgumentParser, "parse_args")):
        monkeypatch.setattr(module, function, _stop_after(getattr(module, function)))
    monkeypatch.syspath_prepend(path.parent)
    with pytest.raises(Understood):
        start(name, run_name="__main__")


def test_named_test_files_exist():
    texts = [*PAGES.values(), *((ROOT / name).read_text() for name in ("CONTRIBUTING.md", "Makefile"))]
    paths = {path for text in texts for path in re.findall(r"\btests/[\w/]+\.py", text)}
    assert len(paths) > 30
    assert [path for path in sorted(paths) if not (ROOT / path).is_file()] == []


def _stop_after(read):
    def read_only(*args, **kwargs):
        read(*args, **kwargs)
        raise Understood

    return read_only


SHOWN = [(one, block) for one, block in pairwise(BLOCKS) if block.language == "text" and one.page == block.page]


@pytest.mark.parametrize(
    ("before", "block"), [pair for pair in SHOWN if pair[0].text.startswith("python -m hierroom complexity")]
)
def test_shown_output_equals_the_commands_output(before, block, capsys):
    [line] = lines_of(before)
    assert complexity(shlex.split(line)[4:]) == 0
    assert capsys.readouterr().out == block.text


NOTEBOOK = json.loads((ROOT / "examples" / "first_steps.ipynb").read_text())
CELLS = ["".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]
CELLS = [re.sub(r"%pip install --quiet {(\w+)}", r"installed.append(\1)", cell) for cell in CELLS]


@pytest.mark.slow
def test_the_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    names: dict[str, object] = {}
    for cell in CELLS:
        *body, last = ast.parse(cell).body
        if not isinstance(last, ast.Expr):
            body, last = [*body, last], None
        exec(compile(ast.Module(body, []), "first_steps.ipynb", "exec"), names)
        if last is not None:
            eval(compile(ast.Expression(last.value), "first_steps.ipynb", "eval"), names)
    assert 0 <= sum(episode.success for episode in names["episodes"]) <= len(names["episodes"]) == 20
