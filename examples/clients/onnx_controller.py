"""A controller is exported to ONNX and plays from there, step by step as the agent itself does."""

import tempfile
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime
import torch

import hierroom

agent = hierroom.load("c", greedy=True)
n, n_features = torch.export.Dim("n", min=1), len(agent.controller.features.cardinalities)
inputs = torch.zeros(2, n_features, dtype=torch.uint8), agent.network.initial_state(2)
with torch.no_grad(), tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "controller.onnx"
    program = torch.export.export(agent.network, inputs, dynamic_shapes=({0: n}, {0: n}))
    names = {"input_names": ("features", "state"), "output_names": ("logits", "values", "new_state")}
    torch.onnx.export(program, (), path, dynamo=True, **names)
    session = onnxruntime.InferenceSession(path)

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
