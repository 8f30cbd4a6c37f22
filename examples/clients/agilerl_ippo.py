"""AgileRL: IPPO for the two agents in the box view of the parallel environment, by the masks in its infos."""

import torch
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy

import hierroom

torch.set_num_threads(1)  # so small a network gains nothing by more
env = hierroom.box_view(hierroom.parallel_env(graph="a", size=11, max_steps=60, subgoal_horizon=20))
agent = IPPO(
    observation_spaces=[env.observation_space(name) for name in env.possible_agents],
    action_spaces=[env.action_space(name) for name in env.possible_agents],
    agent_ids=env.possible_agents,
    learn_step=120,
    batch_size=60,
    update_epochs=2,
)
before = [weight.clone() for actor in agent.actors.values() for weight in actor.parameters()]
population, _ = train_multi_agent_on_policy(
    env, "hierroom", "IPPO", [agent], max_steps=480, evo_steps=240, eval_steps=60, verbose=False
)
after = [weight for actor in population[0].actors.values() for weight in actor.parameters()]
n_changed = sum(bool((old != new).any()) for old, new in zip(before, after, strict=True))
print(f"{n_changed} of {len(after)} weights changed")
