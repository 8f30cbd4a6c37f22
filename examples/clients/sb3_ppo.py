"""Stable-Baselines3: PPO in 32 environments of the batch engine, through `hierroom.sb3_view`."""

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

import hierroom

torch.set_num_threads(1)  # so small a network gains nothing by more
envs = gymnasium.make_vec("hierroom/EscapeRoom-a-v0", 32, size=11, max_steps=200, meta="fixed-dfs", reward="intrinsic")
envs = VecMonitor(hierroom.sb3_view(hierroom.add_features(envs, ["goal-place"])))
model = PPO("MultiInputPolicy", envs, n_steps=64, batch_size=512, n_epochs=2, device="cpu", seed=0)
model.learn(4 * 64 * 32)
print(f"{model.num_timesteps} steps, {len(model.ep_info_buffer)} episodes, {sum(model.ep_success_buffer)} escapes")
