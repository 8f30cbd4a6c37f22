"""CleanRL's PPO loop on the batch engine, through Gymnasium's own vector wrappers."""

import gymnasium
import numpy as np
import torch
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from torch import nn
from torch.distributions import Categorical

import hierroom  # noqa: F401 - registers the ids

torch.set_num_threads(1)  # so small a network gains nothing by more
torch.manual_seed(0)
N, T, GAMMA, LAMBDA, CLIP = 16, 64, 0.95, 0.95, 0.2
SETTINGS = {"size": 11, "max_steps": 100, "meta": "fixed-dfs", "reward": "intrinsic", "autoreset_mode": "SameStep"}
envs = RecordEpisodeStatistics(gymnasium.make_vec("hierroom/EscapeRoom-a-v0", N, **SETTINGS))
observation_space, n_actions = envs.single_observation_space, int(envs.single_action_space.n)
n_inputs = sum(int(np.prod(space.shape)) for space in observation_space.values())
actor = nn.Sequential(nn.Linear(n_inputs, 64), nn.Tanh(), nn.Linear(64, n_actions))
critic = nn.Sequential(nn.Linear(n_inputs, 64), nn.Tanh(), nn.Linear(64, 1))
optimizer = torch.optim.Adam([*actor.parameters(), *critic.parameters()], lr=1e-3)


def as_tensor(values):
    """Return a tensor of float32."""
    return torch.as_tensor(values, dtype=torch.float32)


def as_rows(observations):
    """Return observations by name as a tensor [N, n_inputs]."""
    return torch.cat([as_tensor(values).reshape(N, -1) for values in observations.values()], dim=1)


observation, returns = as_rows(envs.reset(seed=0)[0]), []
for _ in range(8):
    memory = []
    for _ in range(T):
        with torch.no_grad():
            policy, value = Categorical(logits=actor(observation)), critic(observation)[:, 0]
            action = policy.sample()
        following, reward, terminated, truncated, infos = envs.step(action.numpy())
        done = as_tensor(terminated | truncated)
        memory.append((observation, action, policy.log_prob(action), value, as_tensor(reward), done))
        returns += infos["episode"]["r"][infos["_episode"]].tolist() if "episode" in infos else []
        observation = as_rows(following)
    observations, actions, log_probs, values, rewards, dones = map(torch.stack, zip(*memory, strict=True))
    with torch.no_grad():
        advantages, last, after = torch.zeros(T, N), torch.zeros(N), critic(observation)[:, 0]
        for t in reversed(range(T)):
            error = rewards[t] + GAMMA * after * (1 - dones[t]) - values[t]
            advantages[t] = last = error + GAMMA * LAMBDA * (1 - dones[t]) * last
            after = values[t]
    targets = advantages + values
    advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    for _ in range(4):
        policy = Categorical(logits=actor(observations))
        ratio = (policy.log_prob(actions) - log_probs).exp()
        gain = torch.min(ratio * advantages, ratio.clamp(1 - CLIP, 1 + CLIP) * advantages).mean()
        loss = 0.5 * (critic(observations)[..., 0] - targets).square().mean() - gain - 0.01 * policy.entropy().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
print(f"{8 * T * N} steps, {len(returns)} episodes, return {np.mean(returns[-20:]):.2f}")
