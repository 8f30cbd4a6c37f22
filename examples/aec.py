"""Two agents take turns: the meta-controller picks goals, the controller moves. Both act at random here."""

import hierroom

env = hierroom.env(graph="c", max_steps=300, subgoal_horizon=50)
env.reset(seed=0)
turns = dict.fromkeys(env.possible_agents, 0)
for agent in env.agent_iter():
    observation, reward, termination, truncation, info = env.last()
    if termination or truncation:
        env.step(None)
        continue
    turns[agent] += 1
    env.step(env.action_space(agent).sample(observation["action_mask"]))

print(env.unwrapped.complexity)
print(f"turns: {turns}; the exit was {'reached' if info['success'] else 'not reached'} in {info['length']} steps")
