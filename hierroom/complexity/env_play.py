"""Measure a chain in any Gymnasium environment, given a function from its state to a node."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable
from typing import Any

import gymnasium

from hierroom.complexity.played_chain import PlayedChain
from hierroom.complexity.trajectories import check_start, measure_trajectories, missed
from hierroom.support.errors import InputError


def measure_env(
    env: gymnasium.Env,
    node: Callable[[Any], Hashable],
    target: Hashable,
    policy: Callable[[Any], Any] | None = None,
    *,
    episodes: int = 1000,
    seed: int = 0,
    max_steps: int | None = None,
    progress: Callable[[int], object] = lambda done: None,
) -> PlayedChain:
    """Play in a Gymnasium environment, and measure the chain of the nodes that it passes through.

    Args:
        env: the environment.
        node: the node at which an environment is, called after each reset and step; it returns the target once that is
            reached.
        target: the node to reach. An episode that ends elsewhere has missed it: for good
            if it was terminated, and nobody knows whether it would have if it was truncated.
        policy: an action for an observation; random actions by default.
        episodes: number of episodes, at least 1.
        seed: episode e begins with ``env.reset(seed=seed + e)``, so that its level is one of its own; it fixes the
            random actions and the bootstrap too.
        max_steps: ends an episode after so many steps, if the environment does not do so itself.
        progress: called with the number of episodes done.

    Returns:
        The chain and what was observed.

    Warns:
        UserWarning: if no episode reached the target, which may be a misspelt one.
    """
    if episodes < 1 or (max_steps is not None and max_steps < 1):
        raise InputError(f"play at least one episode of at least one step, not {episodes} of {max_steps}")
    env.action_space.seed(seed)
    trajectories, failed = [], []
    for episode in range(episodes):
        observation, _ = env.reset(seed=seed + episode)
        nodes, has_ended, terminated = [node(env)], False, False
        check_start(nodes[0], (trajectories or [nodes])[0][0], target)  # before hours of play
        while not has_ended:
            action = env.action_space.sample() if policy is None else policy(observation)
            observation, _, terminated, truncated, _ = env.step(action)
            nodes.append(node(env))
            has_ended = terminated or truncated or nodes[-1] == target or len(nodes) - 1 == max_steps
        trajectories.append(nodes)
        failed.append(bool(terminated))
        progress(episode + 1)
    played = measure_trajectories(trajectories, target, may_miss=True, failed=failed, seed=seed)
    if not played.counts.escaped.any():
        warnings.warn(missed(target, played.labels[:-1]), stacklevel=2)
    return played
