"""Compiled kernels equal their source run as plain Python, and none reads or writes outside an array."""

import os

import bounds_walk
import pytest
import turns_trace
import world_trace
from children import run_python

KERNELS = (
    *("step_kernels.advance", "view_kernels.look", "generation_kernels.generate", "goal_kernels.write_goals"),
    *("features.find_frontiers", "features._places", "oracle.solve", "observations.write_level"),
    *("recurrent_kernels.lstm_backward", "loss_kernels.loss_backward", "encoder_kernels.encode_rare"),
    *("adam_kernels.adam_step", "elimination._solve_transposed"),
    *("generation_kernels.generate_of_maps", "rooms.find_rooms"),
    *("kernels.step_shops", "kernels.begin_shops", "goal_kernels.write_masks", "goal_kernels.write_ranks"),
)


@pytest.mark.parametrize("module", [world_trace, turns_trace], ids=lambda module: module.__name__)
def test_compiled_kernels_equal_ordinary_python(module, tmp_path):
    """Run the kernels as plain Python, in which numpy raises an error for an index outside of an array."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = run_python(module.__file__, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.strip() == module.trace()
    assert not list(tmp_path.iterdir())  # nothing was compiled


@pytest.mark.slow
def test_no_kernel_indexes_outside_its_arrays(pytestconfig):
    """The cache is kept, as compiling takes most of the time. Tiles check no bounds: see `test_learner_products`."""
    cache = pytestconfig.cache.mkdir("numba-boundscheck")
    variables = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_DISABLE_JIT": "0", "NUMBA_CACHE_DIR": str(cache)}
    done = run_python(bounds_walk.__file__, quiet_seconds=300, env={**os.environ, **variables})
    assert done.returncode == 0, done.stderr
    for name in KERNELS:
        paths = [*cache.rglob(f"{name}-*.nbc")]
        assert paths, name
        assert any(b"index is out of bounds" in path.read_bytes() for path in paths), name
