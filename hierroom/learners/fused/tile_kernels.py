"""Matrix products for small and medium sizes in tiles, without a BLAS library and its threads.

Inside a compiled function ``np.dot`` calls SciPy's BLAS, which starts its own threads; with a second busy process they
made a training step ten times slower. The kernels here accumulate one tile of the result in vector registers. This is
more than twice as fast as plain loops, and no slower than BLAS on one thread. Each entry sums its terms in order, so
results do not depend on the tile.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, config
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic
from numpy.typing import NDArray

from hierroom.support.kernel import njit

_ROWS = 4  # rows of a tile
# Columns of a tile and width of a panel, chosen to leave half of the vector registers for the factors. On AVX-512 a
# tile of 4 x 64 takes two thirds of the time of 8 x 16; so does 4 x 16 on AVX2.
_LANES = 64 if "+avx512f" in get_host_cpu_features() else 16
_DEPTH = 64  # terms that `add_transposed_product` sums at a time; both factors then stay in the L1 cache


def _tile_intrinsic(n_rows: int) -> Callable[..., None]:
    """Make ``tile(c, c_at, c_step, a, a_at, a_step, a_next, b, b_at, depth)``: add a product to n_rows x L of c.

    L is `_LANES`. All positions are flat. Entry (i, j) of the tile is ``c[c_at + i c_step + j]``. For each k below
    ``depth`` the kernel adds ``a[a_at + i a_step + k a_next] * b[b_at + L k + j]`` to it. Bounds are not checked.
    """

    @intrinsic
    def tile(typing, c, c_at, c_step, a, a_at, a_step, a_next, b, b_at, depth):
        def generate(context, builder, signature, arguments):
            c, c_at, c_step, a, a_at, a_step, a_next, b, b_at, depth = arguments
            entry = context.get_value_type(signature.args[0].dtype)
            vector = ir.VectorType(entry, _LANES)
            align = context.get_abi_sizeof(entry)
            undefined = ir.Constant(vector, ir.Undefined)
            first_lane = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), None)

            def data(array, position):
                return context.make_array(signature.args[position])(context, builder, array).data

            def vector_at(pointer, index):
                return builder.bitcast(builder.gep(pointer, [index]), vector.as_pointer())

            c, a, b = data(c, 0), data(a, 3), data(b, 7)
            number = ir.Constant(c_at.type, 0).type
            places, sums = [], []
            for i in range(n_rows):
                place = vector_at(c, builder.add(c_at, builder.mul(c_step, number(i))))
                accumulator = cgutils.alloca_once(builder, vector)
                builder.store(builder.load(place, align=align), accumulator)
                places.append(place)
                sums.append(accumulator)
            with cgutils.for_range(builder, depth) as loop:
                at = builder.add(b_at, builder.mul(loop.index, number(_LANES)))
                right = builder.load(vector_at(b, at), align=align)
                first = builder.add(a_at, builder.mul(loop.index, a_next))
                for i in range(n_rows):
                    at = builder.add(first, builder.mul(a_step, number(i)))
                    left = builder.load(builder.gep(a, [at]))
                    lanes = builder.insert_element(undefined, left, ir.IntType(32)(0))
                    lanes = builder.shuffle_vector(lanes, undefined, first_lane)
                    term = builder.fmul(lanes, right, flags=("contract",))
                    builder.store(builder.fadd(builder.load(sums[i]), term, flags=("contract",)), sums[i])
            for place, accumulator in zip(places, sums, strict=True):
                builder.store(builder.load(accumulator), place, align=align)
            return context.get_dummy_value()

        return types.void(c, *[types.intp] * 2, a, *[types.intp] * 3, b, *[types.intp] * 2), generate

    return tile


_tile = _tile_intrinsic(_ROWS)
_row = _tile_intrinsic(1)


@njit(cache=True, nogil=True)
def pack(matrix: NDArray[np.floating]) -> NDArray[np.floating]:
    """Pack the columns of a matrix [K, N] into zero-padded panels [ceil(N / L), K, L] of L = `_LANES` columns."""
    depth, n_columns = matrix.shape
    panels = np.zeros(((n_columns + _LANES - 1) // _LANES, depth, _LANES), matrix.dtype)
    pack_into(matrix, panels)
    return panels


@njit(cache=True, nogil=True)
def pack_into(matrix, panels):
    """Pack a matrix into an existing array of panels; the padding is not written."""
    for panel in range(len(panels)):
        first = panel * _LANES
        width = min(_LANES, matrix.shape[1] - first)
        for k in range(matrix.shape[0]):
            for lane in range(width):
                panels[panel, k, lane] = matrix[k, first + lane]


@njit(nogil=True)
def _add_tiles(flat, n_columns, a, a_at, a_step, a_next, panels, n_rows):
    """Add a product to ``flat`` [n_rows * n_columns]; see `_tile_intrinsic` for the other arguments."""
    depth = panels.shape[1]
    b = panels.reshape(panels.size)
    for panel in range(n_columns // _LANES):
        b_at = panel * depth * _LANES
        _add_panel(flat, panel * _LANES, n_columns, a, a_at, a_step, a_next, b, b_at, depth, n_rows)
    rest = n_columns % _LANES
    if rest:  # the last panel is padded with zeros, so its rows need a copy as wide as the panel
        wide = np.zeros(n_rows * _LANES, flat.dtype)
        for i in range(n_rows):
            for j in range(rest):
                wide[i * _LANES + j] = flat[(i + 1) * n_columns - rest + j]
        b_at = (len(panels) - 1) * depth * _LANES
        _add_panel(wide, 0, _LANES, a, a_at, a_step, a_next, b, b_at, depth, n_rows)
        for i in range(n_rows):
            for j in range(rest):
                flat[(i + 1) * n_columns - rest + j] = wide[i * _LANES + j]


@njit(nogil=True)
def _add_panel(c, first, c_step, a, a_at, a_step, a_next, b, b_at, depth, n_rows):
    """Add the product with one panel of b to the columns of ``c`` that start at ``first``."""
    tiled = n_rows // _ROWS * _ROWS
    for i in range(0, tiled, _ROWS):
        _tile(c, first + i * c_step, c_step, a, a_at + i * a_step, a_step, a_next, b, b_at, depth)
    for i in range(tiled, n_rows):
        _row(c, first + i * c_step, c_step, a, a_at + i * a_step, a_step, a_next, b, b_at, depth)


@njit(cache=True, nogil=True)
def add_product(a, panels, c):
    """Add ``a @ b`` to ``c``: a [M, K] float, ``panels = pack(b)`` of b [K, N], c [M, N] float; all contiguous."""
    n_rows, depth = a.shape
    _add_tiles(c.reshape(c.size), c.shape[1], a.reshape(a.size), 0, depth, 1, panels, n_rows)


@njit(cache=True, nogil=True)
def add_transposed_product(a, b, c):
    """Add ``a.T @ b`` to ``c``: a [K, M] float, b [K, N] float, c [M, N] float; all contiguous."""
    depth, n_rows = a.shape
    panels = pack(b[:_DEPTH])
    for start in range(0, depth, _DEPTH):
        block = b[start : start + _DEPTH]
        if len(block) < panels.shape[1]:
            panels = pack(block)
        else:
            pack_into(block, panels)
        _add_tiles(c.reshape(c.size), c.shape[1], a.reshape(a.size), start * n_rows, 1, n_rows, panels, n_rows)


def _add_dot(a, b, c):
    c += a @ b


def _add_transposed_dot(a, b, c):
    c += a.T @ b


if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue] - LLVM cannot run as plain Python
    pack, add_product, add_transposed_product = np.copy, _add_dot, _add_transposed_dot
