"""Environments of every API, and how to play in each."""

import chest_task
import gymnasium
import numpy as np

import hierroom
from hierroom.turns.records import META

ID = "hierroom/EscapeRoom-b-v0"
SETTINGS = {"size": 11, "max_steps": 30, "subgoal_horizon": 7}


def play_gymnasium(env, actions):
    for action in actions:
        _, *result, _ = results = env.step(int(action) % 5)
        yield results
        if result[1] or result[2]:
            yield env.reset()


def play_turns(env, actions):
    for action in actions:
        if not env.agents:
            env.reset()
        observation, *result = env.last()
        yield observation, *result, env.observe("meta_0")
        if result[1] or result[2]:
            env.step(None)
        else:
            env.step(int(action) % (14 if env.agent_selection == META else 5))


def play_parallel(env, actions):
    for action in actions:
        yield env.step({"meta_0": int(action), "controller_0": int(action) % 5}) if env.agents else env.reset()


def play_vector(env, actions):
    for action in actions:
        yield env.step((int(action) + np.arange(env.num_envs)) % 5)


def make_rooms(**settings):
    return gymnasium.make_vec(ID, **{"num_envs": 3, **SETTINGS, **settings})


KINDS = {
    "gymnasium": (lambda **s: gymnasium.make(ID, **SETTINGS, **s), play_gymnasium),
    "novelty": (lambda: gymnasium.make(ID, reward="novelty", meta="random", **SETTINGS), play_gymnasium),
    "features": (
        lambda: hierroom.add_features(gymnasium.make(ID, meta="fixed-dfs", **SETTINGS), ["goal-place"]),
        play_gymnasium,
    ),
    "minigrid": (lambda: hierroom.minigrid_view(gymnasium.make(ID, meta="fixed-dfs", **SETTINGS)), play_gymnasium),
    "aec": (lambda **s: hierroom.env(graph="b", **SETTINGS, **s), play_turns),
    "aec boxes": (lambda: hierroom.box_view(hierroom.env(graph="b", **SETTINGS)), play_turns),
    "aec for an agent": (
        lambda: hierroom.add_features(hierroom.env(graph="b", **SETTINGS), hierroom.load("learned-g")),
        play_turns,
    ),
    "parallel": (lambda **s: hierroom.parallel_env(graph="b", **SETTINGS, **s), play_parallel),
    "parallel boxes": (lambda: hierroom.box_view(hierroom.parallel_env(graph="b", **SETTINGS)), play_parallel),
    "task": (lambda: hierroom.parallel_env(chest_task.chest), play_parallel),
    "vector": (make_rooms, play_vector),
    "vector, same step": (lambda: make_rooms(autoreset_mode="SameStep"), play_vector),
    "sb3": (lambda: hierroom.sb3_view(make_rooms()), play_vector),
}


def begin(env):
    if hasattr(env, "seed") and not isinstance(env, gymnasium.Env):
        env.seed(3)
        env.reset()
    else:
        env.reset(seed=3)


def actions(n, seed=0):
    return np.random.default_rng(seed).integers(14, size=n)
