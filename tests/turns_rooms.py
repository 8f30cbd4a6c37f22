"""Small batches of turns, and ways to play in them."""

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GoalGraph
from hierroom.turns import Turns
from hierroom.world.oracle import shortest_actions
from hierroom.world.world import World


def make(graph="d", n=1, *, seed=0, size=11, max_steps=1000, drop_key=False, **settings):
    world = World([GoalGraph.named(graph)], n, size=size, seed=seed, max_steps=max_steps, drop_key=drop_key)
    return Turns(world, **settings)


def goal_ids(turns, *names):
    """Goal ids of ``k1`` (the key of room 1), ``d1`` (its door) and ``x`` (the exit)."""
    colours = turns.world.state.levels[0].colours
    kinds = {"k": 0, "d": FIRST_DOOR_GOAL}
    return {EXIT_GOAL if name == "x" else kinds[name[0]] + int(colours[int(name[1]) - 1]) for name in names}


def achieve(turns, name):
    (goal,) = goal_ids(turns, name)
    for action in shortest_actions(turns.world.get_state(), goal):
        step = turns.step([action])
    assert step.events[0] == goal


def well_or_wildly(rng, world, room=0):
    return int(shortest_actions(world.get_state([room]))[0]) if rng.random() < 0.6 else int(rng.integers(6))
