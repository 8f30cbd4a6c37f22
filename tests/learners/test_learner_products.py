"""Two ways to multiply matrices: tiles in LLVM's own language, and np.dot where they are refused; both are right."""

import os
from pathlib import Path

import numpy as np
import pytest
from children import run_python
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.learners.fused import tile_kernels
from hierroom.learners.fused.product_kernels import BLAS, CHOSEN, Products

TESTS = Path(__file__).parents[1]
GUARDED = """
import ctypes, mmap
import numpy as np
from hierroom.learners.fused.tile_kernels import add_product, add_transposed_product, pack

def guarded(array):
    n_pages = -(-array.nbytes // mmap.PAGESIZE)
    memory = mmap.mmap(-1, (n_pages + 1) * mmap.PAGESIZE)
    end = ctypes.addressof(ctypes.c_char.from_buffer(memory)) + n_pages * mmap.PAGESIZE
    assert ctypes.CDLL(None).mprotect(ctypes.c_void_p(end), mmap.PAGESIZE, 0) == 0  # PROT_NONE
    start = n_pages * mmap.PAGESIZE - array.nbytes
    copy = np.frombuffer(memory, array.dtype, array.size, start).reshape(array.shape)
    copy[...] = array
    return copy

for m, k, n in ((1, 1, 1), (3, 5, 7), (4, 64, 64), (7, 65, 63), (9, 130, 65), (5, 74, 148), (8, 128, 256)):
    a, b, c = (np.ones(shape, np.float32) for shape in ((m, k), (k, n), (m, n)))
    panels = guarded(pack(guarded(b.T.copy()).T))
    for product, factors in ((add_product, (a, panels)), (add_transposed_product, (a.T.copy(), b))):
        result = guarded(c)
        product(*map(guarded, factors), result)
        assert (result == 1 + k).all()
"""


TILES = Products(tile_kernels.pack, tile_kernels.add_product, tile_kernels.add_transposed_product)


def test_tile_products_work_on_this_machine():
    assert CHOSEN == TILES
    assert TILES.work()
    assert BLAS.work()


@pytest.mark.parametrize("products", [TILES, BLAS], ids=["tiles", "blas"])
@given(st.integers(1, 64), st.integers(1, 200), st.integers(1, 260), st.sampled_from([np.float32, np.float64]))
@settings(max_examples=40)
def test_products_equal_those_of_numpy(products, n_rows, depth, n_columns, dtype):
    random = np.random.default_rng(n_rows)
    shapes = (n_rows, depth), (depth, n_columns), (n_rows, n_columns)
    a, b, c = (random.normal(size=shape).astype(dtype) for shape in shapes)
    tolerance = 1e-3 if dtype == np.float32 else 1e-10
    product, transposed = c.copy(), c.copy()
    products.add_product(a, products.pack(b), product)
    products.add_transposed_product(np.ascontiguousarray(a.T), b, transposed)
    for found in (product, transposed):
        np.testing.assert_allclose(found, c + a @ b, rtol=tolerance, atol=tolerance)


def test_tiles_stay_within_their_arrays():
    """Bounds checks do not see them: every array ends where memory does, so that a read or write behind it is fatal."""
    done = run_python("-c", GUARDED)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("name", ["add_product", "add_transposed_product"])
def test_work_detects_wrong_products(name):
    def half(a, b, c):
        getattr(tile_kernels, name)(a, b, c)
        c[-1, -1] = 0  # outside of whole tiles

    assert not TILES._replace(**{name: half}).work()


@pytest.mark.slow
def test_learner_falls_back_to_np_dot_with_a_warning(pytestconfig):
    """With a separate cache, which is kept: the kernels that call the products are compiled with them."""
    cache = pytestconfig.cache.mkdir("numba-blas")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(TESTS), "NUMBA_DISABLE_JIT": "0"}
    test = f"{TESTS / 'learners/test_learner_kernels.py'}::test_compiled_and_torch_updates_agree[rows]"
    plugins = "-p", "refusing_llvmlite", "-p", "no:cacheprovider"
    done = run_python("-m", "pytest", *plugins, test, quiet_seconds=90, env=environment, cwd=TESTS.parent)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("np.dot takes their place, which is slower (NotImplementedError there are no vec") == 1
    assert "1 passed, 1 warning" in done.stdout
    assert [*cache.rglob("product_kernels._add_dot-*.nbc")]
