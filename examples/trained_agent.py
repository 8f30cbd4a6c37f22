"""A trained agent plays in rooms of its own, from Python, and one sees what each step achieves."""

import tempfile
from pathlib import Path

import numpy as np

from hierroom import train
from hierroom.agents.player import Agent
from hierroom.goals import GOAL_NAMES
from hierroom.training.assembly import make_turns
from hierroom.training.run_folder import RunFolder

with tempfile.TemporaryDirectory() as folder:
    train.main(["--graph", "a", "--size", "11", "--rooms", "16", "--steps", "40000", "--out", f"{folder}/run"])
    run = RunFolder.open(Path(folder) / "run")
    agent = Agent.load(run, rooms=2, seed=1)
    rooms = make_turns(run.config(), rooms=2, seed=1)

episodes = 0
while episodes < 4:
    step = agent.step(rooms)
    for room in np.flatnonzero(step.events >= 0):
        print(f"room {room}, step {step.lengths[room]} of the episode: {GOAL_NAMES[step.events[room]]}")
    episodes += step.episode_ended.sum()
