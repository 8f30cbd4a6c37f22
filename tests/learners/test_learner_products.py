"""Products of matrices, in tiles in LLVM's own language."""

import numpy as np
from children import run_python
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.learners.fused.tile_kernels import add_product, add_transposed_product, pack

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


@given(st.integers(1, 64), st.integers(1, 200), st.integers(1, 260), st.sampled_from([np.float32, np.float64]))
@settings(max_examples=40)
def test_products_equal_those_of_numpy(n_rows, depth, n_columns, dtype):
    random = np.random.default_rng(n_rows)
    shapes = (n_rows, depth), (depth, n_columns), (n_rows, n_columns)
    a, b, c = (random.normal(size=shape).astype(dtype) for shape in shapes)
    tolerance = 1e-3 if dtype == np.float32 else 1e-10
    product, transposed = c.copy(), c.copy()
    add_product(a, pack(b), product)
    add_transposed_product(np.ascontiguousarray(a.T), b, transposed)
    for found in (product, transposed):
        np.testing.assert_allclose(found, c + a @ b, rtol=tolerance, atol=tolerance)


def test_tiles_stay_within_their_arrays():
    """Bounds checks do not see them: every array ends where memory does, so that a read or write behind it is fatal."""
    done = run_python("-c", GUARDED)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
