"""A controller is exported to ONNX and plays from there, step by step as the agent itself does."""

import tempfile
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime

import hierroom

agent = hierroom.load("c", greedy=True)
with tempfile.TemporaryDirectory() as folder:
    agent.export(Path(folder) / "controller.onnx")
    session = onnxruntime.InferenceSession(Path(folder) / "controller.onnx")

room = gymnasium.make("hierroom/EscapeRoom-c-v0", meta=agent.meta_controller(), max_steps=100)
env = hierroom.add_features(room, agent)
observation, info = env.reset(seed=0)
memory, state = agent.network.initial_state(1).numpy(), None
n_steps = n_same = 0
is_over = False
while not is_over:
    features = observation["features"][None].astype(np.uint8)
    logits, value, memory = session.run(None, {"features": features, "state": memory})
    action, state = agent.act(observation, state)
    n_same += action == np.where(observation["action_mask"], logits[0], -np.inf).argmax()
    observation, reward, terminated, truncated, info = env.step(action)
    n_steps, is_over = n_steps + 1, terminated or truncated
print(f"{n_same} of {n_steps} actions are the agent's")
