"""A trained agent plays in environments of its own, from Python, and one sees what each step achieves."""

import tempfile
from pathlib import Path

import numpy as np

from hierroom import train
from hierroom.goals import GOAL_NAMES
from hierroom.training.assembly import load_run
from hierroom.training.run_folder import RunFolder

with tempfile.TemporaryDirectory() as folder:
    train.main(["--graph", "a", "--size", "11", "--num-envs", "16", "--steps", "40000", "--out", f"{folder}/run"])
    run = RunFolder.open(Path(folder) / "run")
    turns, pair = load_run(run, num_envs=2, seed=1)

episodes = 0
while episodes < 4:
    step = pair.step(turns)
    for env in np.flatnonzero(step.events >= 0):
        print(f"environment {env}, step {step.lengths[env]} of the episode: {GOAL_NAMES[step.events[env]]}")
    episodes += step.episode_ended.sum()
