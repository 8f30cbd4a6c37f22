"""RLlib: PPO with a policy for each of the two agents, which take turns by their masks, in the box view."""

import os

os.environ |= {"RAY_AUTH_MODE": "disabled", "RAY_USAGE_STATS_ENABLED": "0", "PYTHONWARNINGS": "ignore"}

import ray
from gymnasium import spaces
from pettingzoo.utils import BaseWrapper
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module import MultiRLModuleSpec, RLModuleSpec
from ray.rllib.env.wrappers.pettingzoo_env import PettingZooEnv
from ray.rllib.examples.rl_modules.classes.action_masking_rlm import ActionMaskingTorchRLModule
from ray.tune.registry import register_env

import hierroom

AGENTS = ("meta_0", "controller_0")


class Renamed(BaseWrapper):
    """RLlib's masking module says ``observations`` where PettingZoo says ``observation``, and wants masks of floats."""

    def observation_space(self, agent):
        """Return the same object at every call."""
        if agent not in (made := self.__dict__.setdefault("made", {})):
            box, mask = self.env.observation_space(agent)["observation"], self.env.action_space(agent).n
            made[agent] = spaces.Dict({"action_mask": spaces.Box(0, 1, (mask,)), "observations": box})
        return made[agent]

    def observe(self, agent):
        """Return the box and the mask."""
        seen = self.env.observe(agent)
        return {"action_mask": seen["action_mask"].astype("float32"), "observations": seen["observation"]}


def make_env(config):
    """Return the AEC environment in the terms of RLlib."""
    return PettingZooEnv(Renamed(hierroom.box_view(hierroom.env(**config))))


register_env("escape_room", make_env)
ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
config = (
    PPOConfig()
    .environment("escape_room", env_config={"graph": "a", "size": 11, "max_steps": 60, "subgoal_horizon": 20})
    .env_runners(num_env_runners=0)
    .multi_agent(policies=set(AGENTS), policy_mapping_fn=lambda agent, *_, **__: agent)
    .rl_module(
        rl_module_spec=MultiRLModuleSpec(
            rl_module_specs={agent: RLModuleSpec(module_class=ActionMaskingTorchRLModule) for agent in AGENTS}
        )
    )
    .training(train_batch_size_per_learner=400, minibatch_size=100, num_epochs=2)
)
algorithm = config.build_algo()
for _ in range(2):
    result = algorithm.train()
    learned = {agent: round(float(result["learners"][agent]["total_loss"]), 3) for agent in AGENTS}
    runners = result["env_runners"]
    print(f"{runners['num_env_steps_sampled_lifetime']:.0f} turns, losses {learned}")
algorithm.stop()
ray.shutdown()
