"""Episodes of any player, from Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from hierroom.agents.episode import Episode
from hierroom.agents.player import Pair, Player, make_player
from hierroom.agents.recorder import record
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError, require_number, user_code
from hierroom.support.output import told_or_said
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig


def rollout(
    agent: TrainedAgent | Player | str,
    env: Any = None,
    episodes: int = 100,
    *,
    num_envs: int = 100,
    seed: int = 0,
    progress: Callable[[int], object] | None = None,
    observations: bool = False,
) -> Iterator[Episode]:
    """Let an agent play, and yield each episode with its subgoals, actions, rewards and end.

    Number and order of episodes are fixed: the first of each environment, then the second of each. The first episodes
    to end would be short ones too often. The seed and ``num_envs`` determine the levels and, for a trained agent or a
    named player, the actions.

    Args:
        agent: a trained agent from `hierroom.load` or `hierroom.train`, ``"random"``, ``"oracle"`` (a shortest way to
            the exit), or a `Player`: any object with a method ``step(turns)``.
        env: an `EnvConfig`, or an environment of hierroom of any API; new environments of its config are made. None:
            as in the agent's training, or graph c for other players. Without a reward, an `EnvConfig` uses that of the
            agent's training. Without ``levels``, it uses the evaluation levels, which training never uses.
        episodes: number of episodes, at least 1.
        num_envs: environments that play in parallel, at most as many as episodes.
        seed: determines the environments and the actions.
        progress: called with the number of episodes played so far. None: lines on standard error if play takes long.
        observations: whether to record the controller's observations in `Episode.observations`.

    Examples:
        >>> episodes = list(hierroom.rollout("oracle", hierroom.EnvConfig("a"), episodes=4, seed=0))
        >>> [len(episode) == episode.shortest for episode in episodes]
        [True, True, True, True]
    """
    turns, player = prepare(agent, env, episodes, num_envs, seed)
    return play_episodes(turns, player, episodes, progress, observations=observations)


def play_episodes(
    turns: Turns,
    player: Player,
    episodes: int,
    progress: Callable[[int], object] | None = None,
    *,
    observations: bool = False,
) -> Iterator[Episode]:
    """Let a player play, as `rollout` does."""
    with told_or_said(progress, f"playing {episodes:,} episodes", episodes) as tell:
        yield from record(turns, player, episodes, tell, observations=observations)


def prepare(agent: Any, env: Any, episodes: Any, num_envs: Any, seed: Any) -> tuple[Turns, Player]:
    """Return the environments and the player that the arguments of `rollout` name, checked."""
    for name, value in (("episodes", episodes), ("num_envs", num_envs)):
        require_number(name, value, 1, is_whole=True)
    require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
    num_envs, config = min(num_envs, episodes), None if env is None else _config_of(env)
    if isinstance(agent, TrainedAgent):
        return agent.turns(num_envs, seed=seed, env=config), agent.pair(num_envs, seed=seed)
    if not isinstance(agent, str) and not hasattr(agent, "step"):
        known = "what hierroom.load gives, 'random', 'oracle' or an object with a method step(turns)"
        raise InputError(f"an agent to play is {known}, not {agent!r}")
    config = config or EnvConfig()
    whole = replace(config, curriculum_stages=1, levels=config.levels or "evaluation")
    turns = Turns(whole, num_envs, seed=seed, measure_shortest=True)
    player = make_player(agent, seed) if isinstance(agent, str) else agent if isinstance(agent, Pair) else _Given(agent)
    return turns, player


class _Given:
    """A user-defined player, with its errors reported on one line."""

    def __init__(self, player: Player) -> None:
        self._player = player

    def step(self, turns: Turns) -> Step:
        name = f"the player {type(self._player).__name__}"
        with user_code(name):
            step = self._player.step(turns)
        if isinstance(step, Step) and step is not turns.last_step:
            raise InputError(f"{name} must return the Step of its last turns.step, not another one")
        return step


def _config_of(env: Any) -> EnvConfig:
    if isinstance(env, EnvConfig):
        return env
    inner = getattr(env, "escape_room", getattr(env, "envs", env))  # under minigrid_view and sb3_view
    inner = getattr(inner, "unwrapped", None)
    turns = getattr(getattr(inner, "single", inner), "turns", None)
    if not isinstance(turns, Turns):
        raise InputError(f"env must be an EnvConfig or an environment of hierroom, not {env!r}")
    return turns.config
