"""Functions that measure a chain from trajectories of nodes, or from play in any Gymnasium environment."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np

from hierroom.complexity.chains.chain import EXIT
from hierroom.complexity.chains.weights import first_names, node_labels
from hierroom.complexity.observed import EpisodeCounts
from hierroom.complexity.played_chain import PlayedChain
from hierroom.support.env_results import reset_results, unpaid_step
from hierroom.support.errors import InputError, require_number, shown, user_code
from hierroom.support.output import told_or_said

NO_STEP = "a trajectory must have at least one step, from a node that is not the target"


def measure_trajectories(
    trajectories: Iterable[Sequence[Hashable]],
    target: Hashable,
    *,
    may_miss: bool = False,
    failed: Sequence[bool] | None = None,
    seed: int = 0,
) -> PlayedChain:
    """Return the chain measured from trajectories; its nodes are in order of first appearance, the target last.

    It reports the probability to escape within the median number of steps, and within two and four times as many.

    Args:
        trajectories: the node of each episode at every step. All must begin at the same node. Nodes after the first
            visit to the target are ignored.
        target: the node to reach, where an episode ends; the chain's goal ``"exit"``.
        may_miss: accept that no trajectory reaches the target; the times are infinite then.
        failed: for each episode, whether it terminated without the target; by default such episodes were truncated.
        seed: seed of the bootstrap for the intervals.

    Examples:
        >>> walks = [["in", "hall", "in", "hall", "out"], ["in", "hall", "out"]]
        >>> chain = hierroom.complexity.measure_trajectories(walks, target="out").chain
        >>> round(chain.expected_steps, 3)
        3.0
    """
    numbers: dict[Hashable, int] = {}
    walks: list[list[int]] = []
    reached: list[bool] = []
    for trajectory in trajectories:
        nodes = as_walk(trajectory, target)
        reached.append(target in nodes)
        nodes = nodes[: nodes.index(target)] if reached[-1] else nodes  # without the target, which comes last
        if len(nodes) + reached[-1] < 2 or not nodes:
            raise InputError(NO_STEP)
        check_start(nodes[0], next(iter(numbers), nodes[0]), target)
        walks.append([numbers.setdefault(node, len(numbers)) for node in nodes])
    if not walks:
        raise InputError("a chain is measured from at least one trajectory, but there is none")
    if not (may_miss or any(reached)):
        raise InputError(f"{missed(target, list(numbers))}; pass may_miss=True to allow that")
    if failed is not None and np.shape(failed) != (len(walks),):
        raise InputError(f"failed must have a value for each of {len(walks)} episodes, not {shown(failed)}")
    labels = node_labels([*numbers, target])
    end = len(numbers)
    walks = [[*walk, end] if has_escaped else walk for walk, has_escaped in zip(walks, reached, strict=True)]
    counts = EpisodeCounts.of(walks, end + 1, 0, end, failed)
    lengths = counts.lengths[counts.escaped] if any(reached) else counts.lengths
    median = max(1, int(np.median(lengths)))
    return PlayedChain(counts, labels, 0, {EXIT: (end,)}, times=(median, 2 * median, 4 * median), seed=seed)


def measure_env(
    env: gymnasium.Env,
    node: Callable[[Any], Hashable],
    target: Hashable,
    policy: Callable[[Any], Any] | None = None,
    *,
    episodes: int = 1000,
    seed: int = 0,
    max_steps: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> PlayedChain:
    """Play in a Gymnasium environment, and return the chain measured from the nodes that it visits.

    Args:
        node: returns the current node of an environment; called after each reset and step.
        target: the node to reach. An episode that ends elsewhere missed it; it failed if it was terminated.
        policy: returns an action for an observation; random actions by default.
        episodes: number of episodes, at least 1.
        seed: episode e begins with ``env.reset(seed=seed + e)``; also the seed of random actions and the bootstrap.
        max_steps: number of steps after which an episode is truncated, if the environment does not do so.
        progress: called with the number of episodes done. None: lines on standard error if play takes long.

    Examples:
        >>> lake = gymnasium.make("FrozenLake-v1", is_slippery=False)
        >>> played = hierroom.complexity.measure_env(lake, lambda env: env.unwrapped.s, target=15, episodes=300)
        >>> played.episodes, 0 < played.success_rate < 0.1
        (300, True)
    """
    require_number("the number of episodes", episodes, 1, is_whole=True)
    if max_steps is not None:
        require_number("max_steps", max_steps, 1, is_whole=True)
    require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
    env.action_space.seed(int(np.random.SeedSequence([seed, 1]).generate_state(1)[0]))  # not the env's own numbers
    trajectories, failed = [], []
    with told_or_said(progress, f"playing {episodes:,} episodes", episodes) as tell:
        for episode in range(episodes):
            with user_code("the environment, or a function given with it,"):
                (observation,), _ = reset_results([env.reset(seed=seed + episode)], "the environment")
                nodes, has_ended, terminated = [node(env)], False, False
                check_start(as_walk(nodes, target)[0], (trajectories or [nodes])[0][0], target)  # not after long play
                while not has_ended:
                    action = env.action_space.sample() if policy is None else policy(observation)
                    observation, terminated, truncated = unpaid_step(env.step(action), "the environment")
                    nodes.append(node(env))
                    has_ended = terminated or truncated or nodes[-1] == target or len(nodes) - 1 == max_steps
            trajectories.append(nodes)
            failed.append(terminated)
            tell(episode + 1)
    played = measure_trajectories(trajectories, target, may_miss=True, failed=failed, seed=seed)
    if not played.counts.escaped.any():
        warnings.warn(missed(target, played.labels[:-1]), stacklevel=2)
    return played


def as_walk(nodes: Iterable[Hashable], target: Hashable) -> list[Hashable]:
    """Return a trajectory as a list, after a check that its nodes can be compared."""
    try:
        walk = list(nodes)
        hash((target, *walk))
    except TypeError as error:
        raise InputError(f"a trajectory must be a list of nodes such as texts, numbers or tuples: {error}") from error
    return walk


def check_start(node: Hashable, first: Hashable, target: Hashable) -> None:
    """Check that a trajectory begins where the first one does, and not at the target."""
    if node == target:
        raise InputError(NO_STEP)
    if node != first:
        raise InputError(
            f"all trajectories must begin at the same node, not at {shown(node)} and {shown(first)}; "
            "put one common node before them"
        )


def missed(target: Hashable, seen: Sequence[Hashable]) -> str:
    """Return a message that no episode reaches the target, with the nodes seen, as the target may be misspelt."""
    return f"no episode reaches the target {shown(target)}; nodes seen are {first_names(seen)}"
