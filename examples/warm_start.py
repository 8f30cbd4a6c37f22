"""A controller learns its trade under one meta-controller and goes on under another."""

import tempfile
from pathlib import Path

from hierroom import train

settings = ["--graph", "a", "--size", "11", "--num-envs", "16", "--steps", "4000"]
with tempfile.TemporaryDirectory() as folder:
    first, then = Path(folder) / "first", Path(folder) / "then"
    train.main([*settings, "--meta", "fixed-dfs", "--out", str(first)])
    train.main(
        [*settings, "--meta", "random", "--goal-mask", "existing", "--warm-start", str(first), "--out", str(then)]
    )
    print("the second run began with the weights of the first")
