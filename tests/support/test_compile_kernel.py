"""Compiled kernels: the folder they are kept in, when they are compiled again, and the line while they compile."""

import ast
import os
import pty
import shutil
import subprocess
import tempfile
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from children import run_python
from numba.core import caching

import hierroom
from hierroom.support import errors, kernel
from hierroom.support.kernel import LINE

PACKAGE = Path(hierroom.__file__).parent
PRINT_FOLDER = """
import hierroom
from hierroom.worlds.random_kernels import mix
hierroom.env(graph='a')
print(mix.stats.cache_path)
"""
SLOW = "from hierroom.support import kernel; kernel.PATIENCE_SECONDS = 0.0\n"
COMPILE = """
from hierroom.support.kernel import njit
def double(x):
    return 2 * x
double.__module__ = "{module}"
print(njit()(double)(21), njit()(double)(21))
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    path = tmp_path / "tmp"
    path.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(path))
    return path


@pytest.fixture(scope="module")
def unwritable(tmp_path_factory):
    """A copy of the package where a file stands in the place of the folder for kernels: not even root can make it."""
    site = tmp_path_factory.mktemp("site")
    shutil.copytree(PACKAGE, site / "hierroom", ignore=shutil.ignore_patterns("__pycache__"))
    (site / "hierroom" / "__pycache__").write_bytes(b"")
    return site


def run_there(site, temporary, code=PRINT_FOLDER, **variables):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    home = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "TMPDIR": str(temporary), "PYTHONPATH": str(site)}
    environment |= {**home, "MPLCONFIGDIR": str(temporary), **variables}
    done = run_python("-c", code, env=environment, cwd=site)
    assert done.returncode == 0, done.stderr
    return done


def test_import_works_without_a_writable_package_or_home(unwritable, temporary):
    """Numba raises an error there."""
    done = run_there(unwritable, temporary)
    assert done.stderr.count("RuntimeWarning: ") == 1
    assert "each process compiles kernels again; set NUMBA_CACHE_DIR" in done.stderr
    assert done.stdout.strip() == "None"


@pytest.mark.slow
def test_first_writable_cache_folder_is_used_without_a_warning(unwritable, temporary, tmp_path):
    chosen, cache = {"NUMBA_CACHE_DIR": str(tmp_path / "chosen")}, {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    for variables, place in ((chosen | cache, "chosen"), (cache, "cache")):
        done = run_there(unwritable, temporary, **variables)
        assert done.stderr == ""
        assert Path(done.stdout.strip()).parents[1] == tmp_path / place / "hierroom"
        assert not list(temporary.glob("hierroom*"))


def test_kernels_without_cache_folder_compile_with_a_warning(monkeypatch):
    monkeypatch.setattr(kernel.tempfile, "TemporaryFile", Mock(side_effect=OSError))
    monkeypatch.setattr(kernel, "kernel_folder", kernel.kernel_folder.__wrapped__)  # not the cached answer
    with pytest.warns(RuntimeWarning, match="each process compiles kernels again.*NUMBA_CACHE_DIR"):
        twice = kernel.njit(cache=True)(lambda x: 2 * x)
    assert twice(21) == 42
    assert twice.stats.cache_path is None
    kernel.KERNELS.remove(twice)


def test_kernel_works_with_damaged_files_and_on_a_full_disk(tmp_path, monkeypatch):
    def double(x):
        return 2 * x

    def files():
        return [*tmp_path.rglob("*.nb[ci]")]

    monkeypatch.setattr(kernel, "KERNELS", [])
    monkeypatch.setattr(kernel, "kernel_folder", lambda: str(tmp_path))
    assert kernel.njit(cache=True)(double)(21) == 42
    assert len(files()) == 2
    for damaged in files():
        damaged.write_bytes(b"")  # as after a power failure
        assert kernel.njit(cache=True)(double)(21) == 42
        assert all(path.stat().st_size for path in files())
    for path in files():
        path.unlink()
    errors.warn_once.cache_clear()
    monkeypatch.setattr(caching.IndexDataCacheFile, "_save_data", Mock(side_effect=OSError(28, "No space left")))
    with pytest.warns(UserWarning, match="compiled kernels are not kept.*: No space left"):
        assert kernel.njit(cache=True)(double)(21) == 42


SMALL_PACKAGE = {
    "__init__.py": "",
    "support/__init__.py": "",
    "constants.py": "NUMBER = 1",
    "plain.py": "",
    "inner.py": """
from hierroom.support.kernel import njit
@njit(cache=True)
def inner():
    return 10
""",
    "outer.py": """
import numba
from hierroom.support.kernel import njit
from hierroom.constants import NUMBER
from hierroom.inner import inner
@njit(cache=True)
def outer():
    return inner() + NUMBER
@numba.njit(cache=True)
def users():
    return 0
""",
}


@pytest.mark.slow
def test_changed_kernel_file_recompiles_all_kernels(tmp_path, temporary):
    package = tmp_path / "hierroom"
    shutil.copytree(PACKAGE / "support", package / "support", ignore=shutil.ignore_patterns("__pycache__"))
    for name, content in SMALL_PACKAGE.items():
        (package / name).write_text(content)
    code = "from hierroom.outer import *; print(outer(), sum(outer.stats.cache_hits.values()), users.stats.cache_path)"

    def run():
        result, hits, users = run_there(tmp_path, temporary, code).stdout.split()
        assert Path(users) == package / "__pycache__"  # Numba's own choice
        (folder,) = (package / "__pycache__" / "hierroom").iterdir()  # that of earlier source is removed
        os.utime(folder, (0, 0))
        return int(result), int(hits), folder.name

    first = run()
    (package / "plain.py").write_text("NO_KERNEL = 1")
    again = run()
    assert (first[:2], again[:2]) == ((11, 0), (11, 1))
    (package / "constants.py").write_text("NUMBER = 2")
    number = run()
    (package / "inner.py").write_text(SMALL_PACKAGE["inner.py"].replace("10", "20"))
    callee = run()
    assert (number[:2], callee[:2]) == ((12, 0), (22, 0))
    assert len({first[2], again[2], number[2], callee[2]}) == 3


def on_a_terminal(code):
    ours, theirs = pty.openpty()
    done = run_python("-c", code, stdout=subprocess.PIPE, stderr=theirs, check=True, text=False)
    os.write(theirs, b"|")
    said = b""
    while not said.endswith(b"|"):
        said += os.read(ours, 4096)
    os.close(ours)
    os.close(theirs)
    return said.decode().rstrip("|"), done.stdout.decode()


@pytest.mark.slow
def test_long_compilation_prints_one_line():
    code = COMPILE.format(module="hierroom.worlds.escape_room.step_kernels")
    said, printed = on_a_terminal(SLOW + code)
    assert printed.split() == ["42", "42"]
    assert said.splitlines() == [LINE]
    assert run_python("-c", SLOW + code, check=True).stderr.splitlines() == said.splitlines()
    assert run_python("-c", code, check=True).stderr == ""  # a fraction of a second
    silent = "from hierroom.support.output import silence\nquiet = silence()\nquiet.__enter__()\n"
    assert run_python("-c", SLOW + silent + code, check=True).stderr == ""
    assert on_a_terminal(SLOW + COMPILE.format(module="somebody.elses"))[0] == ""


def test_kernel_compiles_once_for_constants_and_narrow_integers(monkeypatch):
    monkeypatch.setattr(kernel, "KERNELS", [])
    inner = kernel.njit()(lambda x, y: x + y)

    @kernel.njit()
    def outer(x, n):
        return inner(x, 1) + inner(x, 2) + inner(x, n)

    assert outer(0.5, np.int32(3)) == 7.5
    assert len(inner.signatures) == 1
    assert inner(0.5, np.int32(1)) == 1.5  # from Python as ever
    assert len(inner.signatures) == 2


def test_every_kernel_uses_the_njit_of_hierroom():
    for path in PACKAGE.rglob("*.py"):
        if path != Path(kernel.__file__):
            assert "from numba import njit" not in path.read_text(), path
            assert "numba.njit" not in path.read_text(), path


def defining_file(module, name):
    """The file that assigns or defines a name, and does not import it from another of the package."""
    path = PACKAGE.parent / Path(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module and name in {one.asname or one.name for one in node.names}:
            return defining_file(node.module, name)
    return path


def test_digest_covers_every_constant_of_kernels():
    taken = set()
    for path in PACKAGE.rglob("*.py"):
        if "njit(" not in path.read_text():
            continue
        tree = ast.parse(path.read_text())
        module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        kernels = [one for one in ast.walk(tree) if isinstance(one, ast.FunctionDef) and one.decorator_list]
        for function in kernels:
            if any("njit" in ast.unparse(decorator) for decorator in function.decorator_list):
                names = {node.id for node in ast.walk(function) if isinstance(node, ast.Name)}
                imported = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
                for node in imported:
                    if node.module and node.module.startswith("hierroom"):
                        here = {one.name for one in node.names if one.name.isupper()} & names
                        taken |= {(module, name, defining_file(node.module, name)) for name in here}
    assert {path.name for _, _, path in taken} >= {*kernel.CONSTANTS}
    for module, name, path in taken:
        assert path.name in kernel.CONSTANTS or "njit(" in path.read_text(), (module, name, path)
