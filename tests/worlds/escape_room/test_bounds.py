"""No kernel reads or writes outside an array: they are used with bounds checked, where doing so raises."""

import os
import subprocess
import sys
from pathlib import Path

WALK = Path(__file__).with_name("bounds_walk.py")


def test_no_kernel_leaves_its_arrays(pytestconfig):
    """The cache is that of `test_world_python`; the tiles, which check none, are in `test_learner_products`."""
    cache = pytestconfig.cache.mkdir("numba-boundscheck")
    variables = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_DISABLE_JIT": "0", "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, WALK], env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    names = "turn_kernels.write_goals frontier.nearest_frontiers features._places oracle.solve observations.write_one"
    names += " recurrent_kernels.lstm_backward loss_kernels.loss_backward encoder_kernels.encode_rare"
    names += " adam_kernels.adam_step gorp_kernels.sampled_successes ergodic._sampled_cover_times"
    names += " rollout_kernels.random_rollouts elimination._solve_transposed"
    for name in names.split():
        paths = [*cache.rglob(f"{name}-*.nbc")]
        assert paths, name
        assert any(b"index is out of bounds" in path.read_bytes() for path in paths), name
