"""Tianshou: a DQN for each of the two agents, which take turns in the box view of the AEC environment."""

import torch
from tianshou.algorithm import DQN, MultiAgentOffPolicyAlgorithm
from tianshou.algorithm.modelfree.dqn import DiscreteQLearningPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, PettingZooEnv
from tianshou.trainer import OffPolicyTrainerParams
from tianshou.utils.net.common import Net

import hierroom

torch.set_num_threads(1)  # so small a network gains nothing by more


def make_env() -> PettingZooEnv:
    """Both agents have the same spaces: one box with everything, and the mask."""
    return PettingZooEnv(hierroom.box_view(hierroom.env(graph="a", size=11, max_steps=100, subgoal_horizon=20)))


env = make_env()
n_inputs = env.observation_space["observation"].shape
algorithms = []
for _ in env.agents:
    net = Net(state_shape=n_inputs, action_shape=env.action_space.n, hidden_sizes=[64])
    policy = DiscreteQLearningPolicy(model=net, action_space=env.action_space, eps_training=0.3)
    algorithms.append(DQN(policy=policy, optim=AdamOptimizerFactory(lr=1e-3), target_update_freq=100))
agents = MultiAgentOffPolicyAlgorithm(algorithms=algorithms, env=env)

train_envs, test_envs = DummyVectorEnv([make_env] * 4), DummyVectorEnv([make_env])
training = Collector(agents, train_envs, VectorReplayBuffer(4000, 4), exploration_noise=True)
training.reset()
training.collect(n_step=400)
result = agents.run_training(
    OffPolicyTrainerParams(
        training_collector=training,
        test_collector=Collector(agents, test_envs),
        max_epochs=1,
        epoch_num_steps=800,
        collection_step_num_env_steps=40,
        batch_size=64,
        test_step_num_episodes=1,
        multi_agent_return_reduction=lambda returns: returns.sum(axis=-1),
        update_step_num_gradient_steps_per_sample=0.1,
        show_progress=False,
    )
)
print(f"{result.train_step} turns, {result.train_episode} episodes, {result.update_step} updates")
