"""Both agents act at every step; while it is not the meta-controller's turn, its only legal action is to wait."""

import hierroom

env = hierroom.parallel_env(graph="c", max_steps=300, reward="bonus")
observations, infos = env.reset(seed=0)
returns = dict.fromkeys(env.possible_agents, 0.0)
while env.agents:
    actions = {agent: env.action_space(agent).sample(observations[agent]["action_mask"]) for agent in env.agents}
    observations, rewards, terminations, truncations, infos = env.step(actions)
    for agent, reward in rewards.items():
        returns[agent] += reward

print(f"returns: {returns}; {infos['controller_0']}")
