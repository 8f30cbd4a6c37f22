"""The compiled world does what its source does as ordinary Python, and never reads outside an array."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TRACE = Path(__file__).with_name("world_trace.py")
COMPILED = ("step_kernels.advance", "view_kernels.look", "generation_kernels.generate")


def trace(cache: Path, **variables: str) -> str:
    """The digest that `world_trace` prints in a process of its own, with a Numba cache of its own."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), **variables}
    done = subprocess.run([sys.executable, TRACE], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.fixture(scope="module")
def compiled_digest(tmp_path_factory):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "0"}
    return subprocess.run([sys.executable, TRACE], env=environment, capture_output=True, text=True, check=True).stdout


def test_as_ordinary_python(compiled_digest, tmp_path):
    assert trace(tmp_path, NUMBA_DISABLE_JIT="1") == compiled_digest
    assert not list(tmp_path.iterdir())  # nothing was compiled


def test_with_bounds_checked(compiled_digest, pytestconfig):
    """The cache of this run is kept: compiling takes most of its time, and Numba renews it where a source changes."""
    cache = pytestconfig.cache.mkdir("numba-boundscheck")
    assert trace(cache, NUMBA_BOUNDSCHECK="1", NUMBA_DISABLE_JIT="0") == compiled_digest
    compiled = {name: [*cache.rglob(f"{name}-*.nbc")] for name in COMPILED}
    for name, paths in compiled.items():
        assert paths, name
        assert all(b"index is out of bounds" in path.read_bytes() for path in paths), name  # what it raises
