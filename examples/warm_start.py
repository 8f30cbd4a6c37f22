"""A controller learns its trade under one meta-controller and goes on under another."""

import tempfile
from pathlib import Path

import hierroom

settings = {"graph": "a", "size": 11, "num_envs": 16, "steps": 4000, "evaluations": 2}
with tempfile.TemporaryDirectory() as folder:
    first, then = Path(folder) / "first", Path(folder) / "then"
    hierroom.train(meta="fixed-dfs", out=first, **settings)
    hierroom.train(meta="random", goal_mask="existing", warm_start=str(first), out=then, **settings)
    print("the second run began with the weights of the first")
