"""MiniGrid: its wrappers on our levels, and a Stable-Baselines3 PPO on the whole grid as an image."""

import gymnasium
import torch
from minigrid.wrappers import FlatObsWrapper, FullyObsWrapper, ImgObsWrapper, OneHotPartialObsWrapper, RGBImgObsWrapper
from stable_baselines3 import PPO

import hierroom


def make() -> gymnasium.Env:
    """MiniGrid's observations and action ids: 0 left, 1 right, 2 forward, 3 pickup, 4 drop, 5 toggle, 6 done."""
    return hierroom.minigrid_view(gymnasium.make("hierroom/EscapeRoom-b-v0", size=13, max_steps=100, meta="fixed-dfs"))


for wrapper in (ImgObsWrapper, FlatObsWrapper, OneHotPartialObsWrapper, FullyObsWrapper, RGBImgObsWrapper):
    observation, _ = wrapper(make()).reset(seed=0)
    image = observation if wrapper in (ImgObsWrapper, FlatObsWrapper) else observation["image"]
    print(f"{wrapper.__name__}: {image.shape}")

torch.set_num_threads(1)  # so small a network gains nothing by more
model = PPO("MlpPolicy", ImgObsWrapper(FullyObsWrapper(make())), n_steps=128, batch_size=64, n_epochs=2, device="cpu")
model.learn(256)
print(f"{model.num_timesteps} steps on the whole grid")
