"""PettingZoo's tutorial with sb3-contrib: one MaskablePPO plays both agents, which take turns, by their masks."""

import gymnasium
import torch
from pettingzoo.utils import BaseWrapper
from sb3_contrib import MaskablePPO
from sb3_contrib.common.wrappers import ActionMasker

import hierroom


class SB3ActionMaskWrapper(BaseWrapper, gymnasium.Env):
    """The tutorial's wrapper as it is: it passes on ``observation`` and ``action_mask`` only."""

    def reset(self, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed, options)
        self.observation_space = super().observation_space(self.possible_agents[0])["observation"]
        self.action_space = super().action_space(self.possible_agents[0])
        return self.observe(self.agent_selection), {}

    def step(self, action):
        """Take the next agent's turn."""
        current_agent = self.agent_selection
        super().step(action)
        next_agent = self.agent_selection
        return (
            self.observe(next_agent),
            self._cumulative_rewards[current_agent],
            self.terminations[current_agent],
            self.truncations[current_agent],
            self.infos[current_agent],
        )

    def observe(self, agent):
        """Return the observation alone."""
        return super().observe(agent)["observation"]

    def action_mask(self):
        """Return the mask of the next agent."""
        return super().observe(self.agent_selection)["action_mask"]


torch.set_num_threads(1)  # so small a network gains nothing by more
env = hierroom.box_view(hierroom.env(graph="a", size=11, max_steps=100, subgoal_horizon=20))
env = SB3ActionMaskWrapper(env)
env.reset(seed=0)
env = ActionMasker(env, lambda env: env.action_mask())
model = MaskablePPO("MlpPolicy", env, n_steps=256, batch_size=64, n_epochs=2, device="cpu", seed=0)
model.learn(1024)
print(f"{model.num_timesteps} turns, the last episode of {model.ep_info_buffer[-1]['l']}")
