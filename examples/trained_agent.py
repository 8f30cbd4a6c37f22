"""Train from Python, load what was trained, let it play, and look at what it did."""

import tempfile
from pathlib import Path

import hierroom

with tempfile.TemporaryDirectory() as folder:
    run = Path(folder) / "run"
    hierroom.train(graph="a", size=11, num_envs=16, steps=40_000, evaluations=4, out=run)
    agent = hierroom.load(run)  # the same as train gave, in another process or on another day

lengths, n_escapes = [], 0
for episode in hierroom.rollout(agent, episodes=100):
    lengths.append(len(episode))
    n_escapes += episode.success
print(f"{n_escapes} of {len(lengths)} episodes escaped, in {sum(lengths) / len(lengths):.1f} steps on average")

episode = next(hierroom.rollout(agent, hierroom.EnvConfig("c", size=13), episodes=1))  # where it was not trained
print(episode)
for subgoal in episode.subgoals:
    print(f"step {subgoal.first_step}: {subgoal.name}, {subgoal.outcome} after {subgoal.steps} steps")
