"""A trained agent plays, and its episodes become a Minari data set that makes their environment again."""

import os
import tempfile

with tempfile.TemporaryDirectory() as folder:
    os.environ["MINARI_DATASETS_PATH"] = folder
    import minari

    import hierroom

    env = hierroom.EnvConfig("c", reward="extrinsic", max_steps=200)
    hierroom.minari_dataset("hierroom/c/hippo-v0", hierroom.load("c"), env, episodes=20)
    data = minari.load_dataset("hierroom/c/hippo-v0")
    same_env = data.recover_environment()
    same_env.reset(seed=0)
    escapes = sum(episode.rewards.sum() for episode in data.iterate_episodes())
    print(f"{data.total_steps} steps in {data.total_episodes} episodes, {escapes:.0f} escapes")
