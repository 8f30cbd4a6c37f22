"""Small batches of turns, and ways to play in them."""

import numpy as np

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL
from hierroom.turns.records import RULES, STEP
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.layout import MEMORIES
from hierroom.worlds.escape_room.oracle import shortest_actions


def open_goals(graph, keys, doors):
    """Flags [..., 2 B + 1] of the keys, doors and exit that can be achieved next; keys and doors are flags [..., B]."""
    held, is_open = np.asarray(keys, bool), np.asarray(doors, bool)
    can_enter = np.concatenate([np.ones((*is_open.shape[:-1], 1), bool), is_open], axis=-1)
    keys_in_reach = ~held & ~is_open & can_enter[..., graph.key_rooms]
    return np.concatenate([keys_in_reach, held & ~is_open, can_enter[..., [graph.exit_room]]], axis=-1)


def make(
    graph="d",
    n=1,
    *,
    seed=0,
    size=11,
    reward="extrinsic",
    autoreset=True,
    measure_shortest=False,
    memories=tuple(MEMORIES),
    **settings,
):
    """Turns in n environments; ``settings`` are further entries of the `EnvConfig`."""
    return Turns(
        EnvConfig(graph=graph, size=size, reward=reward, **settings),
        n,
        seed=seed,
        autoreset=autoreset,
        measure_shortest=measure_shortest,
        memories=memories,
    )


def record(
    ledger, actions, outcomes, *, return_ends_with_option, subgoal_horizon, n_actions=5, autoreset=False, weights=()
):
    """Take the controller's turn by the kernel; return the records of the step and how many episodes ended."""
    steps = np.empty(len(outcomes), STEP)
    rules = np.zeros(1, RULES)
    given = {"return_ends_with_option": return_ends_with_option, "horizon": subgoal_horizon, "n_actions": n_actions}
    for name, value in {**given, **dict(weights), "autoreset": autoreset, "target": EXIT_GOAL}.items():
        rules[name] = value
    return steps, ledger.record(outcomes, actions, steps, rules)


def fields(step):
    """The fields of a step by name."""
    return {name: step.records[name] for name in STEP.names}


def goal_ids(turns, *names):
    """Goal ids of ``k1`` (the key of room 1), ``d1`` (its door) and ``x`` (the exit)."""
    colours = turns.world.state.levels[0].colours
    kinds = {"k": 0, "d": FIRST_DOOR_GOAL}
    return {EXIT_GOAL if name == "x" else kinds[name[0]] + int(colours[int(name[1]) - 1]) for name in names}


def bits(goals):
    goals = np.asarray(goals)
    return np.where(goals < 0, 0, 1 << np.maximum(goals, 0))


def achieve(turns, name):
    (goal,) = goal_ids(turns, name)
    for action in shortest_actions(turns.world.get_state(), goal):
        step = turns.step([action])
    assert step.events[0] == goal


def well_or_wildly(rng, world, env=0):
    """An action on a shortest way to the exit, or any."""
    return int(shortest_actions(world.get_state([env]))[0]) if rng.random() < 0.6 else int(rng.integers(6))
