"""The controller alone in 64 environments, with goals along a random depth-first path."""

import time

import gymnasium

import hierroom  # noqa: F401 - registers the ids

env = gymnasium.make_vec("hierroom/EscapeRoom-c-v0", num_envs=64, meta="fixed-dfs", reward="intrinsic", max_steps=200)
observations, infos = env.reset(seed=0)
goals_reached, episodes, started = 0, 0, time.perf_counter()
for _ in range(500):
    observations, rewards, terminations, truncations, infos = env.step(env.action_space.sample())
    goals_reached += int(rewards.sum())
    episodes += int((terminations | truncations).sum())

seconds = time.perf_counter() - started
print(f"{goals_reached} goals reached in {episodes} episodes, {500 * 64 / seconds:,.0f} steps a second")
