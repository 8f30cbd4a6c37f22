"""Play without learning: the players, and the loop that plays a given number of episodes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.meta import META_CONTROLLERS
from hierroom.support.errors import InputError, shown
from hierroom.turns.records import CONTROLLER, META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.actions import actions_in
from hierroom.worlds.base import BaseWorld

if TYPE_CHECKING:
    from hierroom.agents.ppo_agent import FrozenAgent, PPOAgent


class Player(Protocol):
    """Plays in environments; any object that takes their steps is a player."""

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment."""
        ...


class Pair:
    """A meta-controller and a controller that play together, by the names in `records.AGENTS` and in that order."""

    def __init__(self, agents: Mapping[str, PPOAgent | FrozenAgent | ScriptedAgent]) -> None:
        self.agents = agents

    def choose(self, turns: Turns, *names: str) -> None:
        """Let agents, all by default, choose their actions.

        The meta-controller chooses only where its turn is due, at most once per option. The controller chooses, and
        its recurrent state changes, at every call.
        """
        for name in names or self.agents:
            due = turns.due(name)
            if len(due):
                observation = turns.observe(name, due)
                turns.act(name, observation, self.agents[name].act(observation))

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment."""
        self.choose(turns)
        step = turns.step()
        for agent in self.agents.values():
            agent.record(step, turns)
        return step

    def subset(self, envs: NDArray[np.integer]) -> Pair | None:
        """Return the pair for some environments [M], where it acts as if it still played in all; None if it cannot.

        This needs a built-in meta-controller that does not learn and a frozen controller. Other agents may act
        differently in fewer environments.
        """
        # Imported here because it loads torch, which ``--help`` does not need.
        from hierroom.agents.ppo_agent import FrozenAgent

        meta, controller = self.agents.get(META), self.agents.get(CONTROLLER)
        if type(meta) is not ScriptedAgent or type(controller) is not FrozenAgent:
            return None
        is_memoryless = type(meta.meta) in META_CONTROLLERS.values()
        return Pair({META: meta, CONTROLLER: controller.subset(envs)}) if is_memoryless else None


class RandomPlayer:
    """Controller actions drawn uniformly at random, without goals."""

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random

    def actions(self, world: BaseWorld) -> NDArray:
        """Draw a legal action for every environment."""
        if (masks := world.action_masks) is not None:
            return np.where(masks, self._random.random(masks.shape), -1).argmax(axis=1)
        return actions_in(world).sample(self._random, len(world))

    def step(self, turns: Turns) -> Step:
        """Take a random action in every environment."""
        return turns.step(self.actions(turns.world))


class OraclePlayer:
    """A shortest path to the target, without goals."""

    def __init__(self) -> None:
        self._plans: dict[int, deque[int]] = {}

    def step(self, turns: Turns) -> Step:
        """Take the next action of a shortest path in every environment."""
        for env in range(len(turns)):
            if not self._plans.get(env):
                self._plans[env] = deque(turns.world.shortest_actions(env).tolist())
        step = turns.step(np.array([self._plans[env].popleft() for env in range(len(turns))]))
        for env in np.flatnonzero(step.episode_ended).tolist():
            self._plans[env].clear()
        return step


def make_player(name: str, seed: int) -> Player:
    """Return a player that needs no training, ``"random"`` or ``"oracle"``; the seed determines its actions."""
    if name == "random":
        return RandomPlayer(np.random.default_rng(seed))
    if name == "oracle":
        return OraclePlayer()
    raise InputError(f"the players without training are random and oracle; there is no {name!r}")


SHARE_KEPT = 0.5
"""Leave environments out only when at most this share of them still counts, because leaving out takes time."""


class Play:
    """Lets a player play the first episodes of each of N new environments (see `quotas`), then closes these.

    Counting whichever episodes end first would count short ones too often. Environments that have played their quota
    are left out later, if the player allows it. The others play the same, except for rounding where torch computes the
    network.

    It yields each primitive `Step` of M environments: all N at first, fewer once some have played their quota.

    Attributes:
        turns: the M environments that were stepped.
        envs: [M] int, their indices among the N.
        counted: [C] int, the positions among the M where episodes still count.
        played: [N] int, counted episodes that each environment had ended before the step.
    """

    def __init__(
        self, turns: Turns, player: Player, episodes: int, progress: Callable[[int], object] = lambda done: None
    ) -> None:
        self.turns, self._player, self._progress = turns, player, progress
        self._quota, self.played = quotas(episodes, len(turns)), np.zeros(len(turns), np.int64)
        self.envs, self.counted = np.arange(len(turns)), np.flatnonzero(self._quota)

    def __iter__(self) -> Iterator[Step]:
        try:
            while len(self.counted):
                is_few = len(self.counted) <= SHARE_KEPT * len(self.envs) and self.turns.can_split
                if is_few and type(self._player) is Pair and (part := self._player.subset(self.counted)):
                    self._player, self.turns = part, self.turns.subset(self.counted)
                    self.envs, self.counted = self.envs[self.counted], np.arange(len(self.counted))
                step = self._player.step(self.turns)
                if not isinstance(step, Step):
                    found = f"the Step that turns.step returned, not {shown(step)}"
                    raise InputError(f"step of a player must return {found}")
                yield step
                ended = self.counted[step.episode_ended[self.counted]]
                if len(ended):
                    self.played[self.envs[ended]] += 1
                    self.counted = np.flatnonzero(self.played[self.envs] < self._quota[self.envs])
                    self._progress(int(self.played.sum()))
        finally:
            self.turns.world.close()


def quotas(episodes: int, num_envs: int) -> NDArray[np.int64]:
    """Split episodes among environments: return equal numbers [N], with one more for the first ones if needed."""
    if episodes < 1:
        raise InputError(f"play at least one episode, not {episodes}")
    return episodes // num_envs + (np.arange(num_envs) < episodes % num_envs)
