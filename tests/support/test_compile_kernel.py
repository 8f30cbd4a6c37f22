"""Compiled kernels are kept wherever there is a place for them; on a terminal one hears that they are compiled."""

import ast
import os
import pty
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from hierroom.support.compile import folder, kernel
from hierroom.worlds.escape_room import step_kernels

PACKAGE = Path(folder.__file__).parents[1]
TELL = """
import hierroom
from hierroom.worlds.escape_room.random_kernels import mix
hierroom.env(graph='a')
print(mix.stats.cache_path)
"""
COMPILE = """
from hierroom.support.compile.kernel import njit, KERNELS, PACKAGE, digest_of_kernels
def double(x):
    return 2 * x
double.__module__ = "{module}"
print(njit()(double)(21), njit()(double)(21))
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A folder for temporary files of this test's own."""
    path = tmp_path / "tmp"
    path.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(path))
    return path


@pytest.fixture(scope="module")
def unwritable(tmp_path_factory):
    """A copy of the package where files stand in the place of the folders that Numba would make: not even root can."""
    site = tmp_path_factory.mktemp("site")
    shutil.copytree(PACKAGE, site / "hierroom", ignore=shutil.ignore_patterns("__pycache__"))
    for path in [site / "hierroom", *(site / "hierroom").rglob("*/")]:
        (path / "__pycache__").write_bytes(b"")
    return site


def run_there(site, temporary, code=TELL, **variables):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    home = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "TMPDIR": str(temporary), "PYTHONPATH": str(site)}
    environment |= {**home, "MPLCONFIGDIR": str(temporary), **variables}
    return subprocess.run([sys.executable, "-c", code], env=environment, cwd=site, capture_output=True, text=True)


def test_the_package_is_imported_where_neither_it_nor_home_can_be_written(unwritable, temporary):
    """Numba raises there: cannot cache function, no locator available."""
    for _ in range(2):
        done = run_there(unwritable, temporary)
        assert done.returncode == 0, done.stderr
        expected = temporary / f"hierroom-kernels-{os.getuid()}"
        assert done.stderr.count("RuntimeWarning: ") == 1
        assert f"kept in {expected}; set NUMBA_CACHE_DIR" in done.stderr
        assert Path(done.stdout.strip()).parent == expected
        assert stat.S_IMODE(expected.stat().st_mode) == 0o700


def test_children_hear_of_the_folder_and_do_not_warn_again(unwritable, temporary):
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {TELL!r}], check=True)"
    done = run_there(unwritable, temporary, code=f"import hierroom.worlds.escape_room.step_kernels; {child}")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("RuntimeWarning: ") == 1
    assert str(temporary) in done.stdout


def test_a_folder_of_ones_own_choice_is_taken_without_a_word(unwritable, temporary, tmp_path):
    done = run_there(unwritable, temporary, NUMBA_CACHE_DIR=str(tmp_path / "own"))
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(done.stdout.strip()).parent == tmp_path / "own"
    assert not list(temporary.iterdir())


def test_the_private_folder_is_found_again(temporary):
    path = Path(folder.private_folder())
    assert path.parent == temporary
    assert stat.S_IMODE(path.stat().st_mode) == 0o700
    assert folder.private_folder() == str(path)


@pytest.mark.parametrize("planted", ["link", "open", "file", "other's"])
def test_what_others_could_have_planted_is_not_used(temporary, planted, monkeypatch):
    """Compiled code is run when it is read, so a folder in which others may write is a way in."""
    path = temporary / f"hierroom-kernels-{os.getuid()}"
    if planted == "link":
        (temporary / "theirs").mkdir(mode=0o700)
        path.symlink_to(temporary / "theirs")
    elif planted == "open":
        path.mkdir()
        path.chmod(0o770)
    elif planted == "file":
        path.write_bytes(b"")
    else:
        user = os.getuid()
        path.mkdir(mode=0o700)
        monkeypatch.setattr(os, "getuid", lambda: user + 1)
        path.rename(temporary / f"hierroom-kernels-{user + 1}")
    removed = []
    monkeypatch.setattr(folder.atexit, "register", lambda function, path, **_: removed.append(path))
    found = Path(folder.private_folder())
    assert found.parent == temporary
    assert found != path
    assert stat.S_IMODE(found.stat().st_mode) == 0o700
    assert removed == [str(found)]


def test_without_any_place_kernels_are_compiled_and_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert folder.private_folder() is None
    kernel._told_folder.cache_clear()
    with pytest.warns(RuntimeWarning, match="is lost at the end of each process.*NUMBA_CACHE_DIR"):
        assert not kernel._move_cache()
    kernel._told_folder.cache_clear()


def on_a_terminal(code):
    """What a process writes to its standard error, a terminal."""
    ours, theirs = pty.openpty()
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=theirs, check=True)
    os.write(theirs, b"|")
    said = b""
    while not said.endswith(b"|"):
        said += os.read(ours, 4096)
    os.close(ours)
    os.close(theirs)
    return said.decode().rstrip("|"), done.stdout.decode()


def test_compiling_is_told_once_on_a_terminal():
    said, printed = on_a_terminal(COMPILE.format(module="hierroom.worlds.escape_room.step_kernels"))
    assert printed.split() == ["42", "42"]
    assert said.splitlines() == [kernel.NOTICE_TEXT]


def test_compiling_is_not_told_of_for_others_or_to_files():
    assert on_a_terminal(COMPILE.format(module="somebody.elses"))[0] == ""
    code = COMPILE.format(module="hierroom.worlds.escape_room.step_kernels")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""


def test_every_kernel_is_made_by_the_package_s_own_decorator():
    for path in PACKAGE.rglob("*.py"):
        if path != Path(kernel.__file__):
            assert "from numba import njit" not in path.read_text(), path
            assert "numba.njit" not in path.read_text(), path


def test_a_change_in_any_file_of_kernels_makes_numba_compile_all_of_them_again(tmp_path):
    contents = {"a.py": "@njit()\n", "b.py": "@njit()\n#", "c.py": "no kernel", "constants.py": "NUMBER = 1"}
    digests = []
    for name, content in [*contents.items(), ("c.py", "none"), ("b.py", "@njit()"), ("constants.py", "NUMBER = 2")]:
        (tmp_path / name).write_text(content)
        kernel.digest_of_kernels.cache_clear()
        digests.append(kernel.digest_of_kernels(tmp_path))
    before, no_kernel, other, number = digests[-4:]
    assert before == no_kernel
    assert len({before, other, number}) == 3
    kernel.digest_of_kernels.cache_clear()
    assert step_kernels.advance in kernel.KERNELS
    assert {one._cache._cache_file._source_stamp[1] for one in kernel.KERNELS} == {kernel.digest_of_kernels(PACKAGE)}


def defining_file(module, name):
    """The file that assigns or defines a name, and does not import it from another of the package."""
    path = PACKAGE.parent / Path(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module and name in {one.asname or one.name for one in node.names}:
            return defining_file(node.module, name)
    return path


def test_every_number_that_a_kernel_takes_from_another_file_is_part_of_the_digest():
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
