"""TorchRL: PPO for each of the two agents in the box view, and masked random play where they take turns."""

import torch
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch.distributions import Categorical
from torchrl.envs import PettingZooWrapper, RewardSum, TransformedEnv, check_env_specs
from torchrl.modules import MLP, ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss, ValueEstimators

import hierroom

SETTINGS = {"graph": "a", "size": 11, "max_steps": 60, "subgoal_horizon": 20}
torch.set_num_threads(1)  # so small a network gains nothing by more
torch.manual_seed(0)

for turns in (hierroom.env(**SETTINGS), hierroom.box_view(hierroom.env(**SETTINGS))):
    env = PettingZooWrapper(turns, use_mask=True)
    check_env_specs(env)
    data = env.rollout(200, break_when_any_done=False)
    print(f"{len(data)} turns at random, {int(data['next', 'done'].sum())} episodes ended")

env = PettingZooWrapper(hierroom.box_view(hierroom.parallel_env(**SETTINGS)), categorical_actions=True, seed=0)
env = TransformedEnv(env, RewardSum([(group, "reward") for group in env.group_map], reset_keys=["_reset"] * 2))
check_env_specs(env)
actors, losses = [], []
for group in env.group_map:  # "meta" and "controller", one agent each
    observation, action = (group, "observation"), (group, "action")
    size, n_actions = env.observation_spec[observation].shape[-1], env.full_action_spec_unbatched[action].space.n
    module = TensorDictModule(MLP(size, n_actions, num_cells=[64]), [observation], [(group, "logits")])
    actor = ProbabilisticActor(
        module, in_keys=[(group, "logits")], out_keys=[action], distribution_class=Categorical, return_log_prob=True
    )
    critic = ValueOperator(MLP(size, 1, num_cells=[64]), in_keys=[observation], out_keys=[(group, "state_value")])
    loss = ClipPPOLoss(actor, critic, normalize_advantage=True)
    loss.set_keys(
        reward=(group, "reward"),
        action=action,
        value=(group, "state_value"),
        done=(group, "done"),
        terminated=(group, "terminated"),
        sample_log_prob=actor.log_prob_keys[0],
    )
    loss.make_value_estimator(ValueEstimators.GAE, gamma=0.99, lmbda=0.95)
    actors.append(actor)
    losses.append(loss)

policy = TensorDictSequential(*actors)
optimizer = torch.optim.Adam([weight for loss in losses for weight in loss.parameters()], lr=1e-3)
for _ in range(3):
    with torch.no_grad():
        data = env.rollout(240, policy, break_when_any_done=False)
        for loss in losses:
            loss.value_estimator(
                data, params=loss.critic_network_params, target_params=loss.target_critic_network_params
            )
    for _ in range(2):
        terms = [loss(data) for loss in losses]
        total = sum(term["loss_objective"] + term["loss_critic"] + term["loss_entropy"] for term in terms)
        optimizer.zero_grad()
        total.backward()
        optimizer.step()
    print(f"{len(data)} steps, {int(data['next', 'done'].sum())} episodes ended, loss {total.item():.3f}")
