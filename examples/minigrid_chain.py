"""Complexity of two MiniGrid levels: the chain of their subgoals, measured from random play.

    python minigrid_chain.py

The paper's method needs no EscapeRoom: a function from the state of an environment to a node is enough.
"""

import gymnasium
import minigrid  # noqa: F401 - registers its environments
from minigrid.core.world_object import Ball, Door, Key

from hierroom.complexity import measure_env


def subgoals(env):
    """Return the subgoals that are achieved: the key held, a locked door opened; and whether the mission is done."""
    level = env.unwrapped
    here = level.grid.get(*level.agent_pos)
    if isinstance(level.carrying, Ball) or (here is not None and here.type == "goal"):
        return "done"
    is_open = not any(isinstance(thing, Door) and thing.is_locked for thing in level.grid.grid)
    held = "key held" if isinstance(level.carrying, Key) else "no key"
    return f"{held}, door {'open' if is_open else 'locked'}"


for name in ("MiniGrid-DoorKey-5x5-v0", "MiniGrid-KeyCorridorS3R1-v0"):
    played = measure_env(gymnasium.make(name), subgoals, "done", episodes=100)
    print(name, played, sep="\n")
    bottleneck = played.chain.edge_sensitivity()[0]
    print(f"  one percent more of {bottleneck.source} -> {bottleneck.target}: {bottleneck.elasticity:+.2f}% steps\n")
