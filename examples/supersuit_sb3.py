"""One Stable-Baselines3 policy for both agents, through SuperSuit: a box view makes their spaces flat and equal."""

import torch
from stable_baselines3 import PPO
from supersuit import concat_vec_envs_v1, pettingzoo_env_to_vec_env_v1

import hierroom

env = hierroom.box_view(hierroom.parallel_env(graph="a", size=11, max_steps=200))
env = concat_vec_envs_v1(pettingzoo_env_to_vec_env_v1(env), 4, base_class="stable_baselines3")
env.venv.reset(seed=0)  # SuperSuit's wrapper has no seed of its own; each copy goes on from here

torch.set_num_threads(1)  # so small a network gains nothing by more
model = PPO("MlpPolicy", env, n_steps=128, batch_size=256, n_epochs=2, device="cpu")
model.learn(2 * 128 * env.num_envs)
print(f"{model.num_timesteps} turns of both agents in {env.num_envs // 2} environments")
