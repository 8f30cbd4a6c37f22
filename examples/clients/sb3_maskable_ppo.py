"""sb3-contrib: MaskablePPO on a Gymnasium id, which has ``action_masks``."""

import gymnasium
import torch
from sb3_contrib import MaskablePPO

import hierroom  # noqa: F401 - registers the ids

torch.set_num_threads(1)  # so small a network gains nothing by more
env = gymnasium.make("hierroom/EscapeRoom-a-v0", size=11, max_steps=100)
model = MaskablePPO("MultiInputPolicy", env, n_steps=256, batch_size=64, n_epochs=2, device="cpu", seed=0)
model.learn(1024)
print(f"{model.num_timesteps} steps, {len(model.ep_info_buffer)} episodes")
