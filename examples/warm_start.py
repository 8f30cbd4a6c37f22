"""A controller learns its trade under one meta-controller and goes on under another."""

import tempfile
from pathlib import Path

from hierroom import train

room = ["--graph", "a", "--size", "11", "--rooms", "16", "--steps", "4000"]
with tempfile.TemporaryDirectory() as folder:
    first, then = Path(folder) / "first", Path(folder) / "then"
    train.main([*room, "--meta", "fixed-dfs", "--out", str(first)])
    train.main([*room, "--meta", "random", "--goal-mask", "existing", "--warm-start", str(first), "--out", str(then)])
    print("the second run began with the weights of the first")
