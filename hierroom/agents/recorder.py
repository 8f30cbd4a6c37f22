"""Record the episodes that a player plays."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.episode import Episode
from hierroom.agents.episode_facts import EndedEpisodes, EpisodeFacts
from hierroom.agents.player import Play, Player
from hierroom.turns.kernels import NO_OUTCOME
from hierroom.turns.records import CONTROLLER, Step
from hierroom.turns.turns import Turns

_PARTS = {"rewards": "f8", "extrinsic": "f8", "goals": "i1", "achieved": "i1", "outcomes": "i1"}
"""Values recorded at each step, with their dtypes, by their names in `Episode`."""


def record(
    turns: Turns,
    player: Player,
    episodes: int,
    progress: Callable[[int], object] = lambda done: None,
    *,
    observations: bool = False,
) -> Iterator[Episode]:
    """Let a player play the first episodes of each environment (see `Play`), and yield them in a fixed order.

    The order is the first episode of every environment, then the second of every environment, and so on. It does not
    depend on episode lengths, so the first K episodes are as good a sample as all. With ``observations`` episodes
    include the controller's observations.
    """
    facts, finished, n_yielded, n = EpisodeFacts(len(turns)), {}, 0, len(turns)
    tape, play = _Tape(turns, _Observed(turns) if observations else None), Play(turns, player, episodes, progress)
    for step in play:
        ended = facts.add(step, play.turns, play.envs, play.counted)
        for row, episode in zip(ended.rows.tolist(), tape.add(step, play, ended), strict=True):
            finished[int(play.played[play.envs[row]]), int(play.envs[row])] = episode
        while (place := divmod(n_yielded, n)) in finished:
            yield finished.pop(place)
            n_yielded += 1


class _Observed:
    """The controller's observations in current episodes, without the goal, which is not chosen yet."""

    def __init__(self, turns: Turns) -> None:
        self._so_far: list[list[tuple[dict[str, NDArray], int]]] = [[] for _ in range(len(turns))]
        self._vectors = turns.world.goals.vectors
        every = np.arange(len(turns))
        self.see(turns, every, every)

    def see(self, turns: Turns, rows: NDArray[np.integer], envs: NDArray[np.integer]) -> None:
        """Record the observations in rows [M] of these turns, which belong to environments ``envs`` [M]."""
        shown = turns.observe(CONTROLLER, turns.due(CONTROLLER)).as_dict()
        for row, env in zip(rows.tolist(), envs.tolist(), strict=True):
            self._so_far[env].append((shown, row))

    def ended(self, env: int, last: dict[str, NDArray], row: int, goals: NDArray[np.integer]) -> dict[str, NDArray]:
        """Return an episode's observations by name, with goals [L]; the last observation is one row of ``last``."""
        moments, self._so_far[env] = [*self._so_far[env], (last, row)], []
        observations = {name: np.stack([shown[name][at] for shown, at in moments]) for name in last}
        observations["goal"][:-1] = self._vectors[goals]
        return observations


class _Tape:
    """The steps of the current episodes, from the start of N new environments."""

    def __init__(self, turns: Turns, observed: _Observed | None) -> None:
        self._observed = observed
        kind = turns.action_kind
        self._parts: dict[str, NDArray] = {name: np.zeros((64, len(turns)), dtype) for name, dtype in _PARTS.items()}
        self._parts["actions"] = np.zeros((64, len(turns), *kind.shape), kind.kept_type)
        self._starts = [turns.world.get_state(env) for env in range(len(turns))]

    def add(self, step: Step, play: Play, ended: EndedEpisodes) -> list[Episode]:
        """Record a step and return the episodes that it ended."""
        envs, at, world = play.envs, step.lengths - 1, play.turns.world
        if at.max() >= len(self._parts["actions"]):
            self._parts = {name: np.concatenate([part, np.zeros_like(part)]) for name, part in self._parts.items()}
        noted = {name: getattr(step, name) for name in ("actions", "rewards", "extrinsic", "goals")}
        noted |= {"achieved": step.events, "outcomes": np.where(step.option_ended, step.outcomes, NO_OUTCOME)}
        for name, values in noted.items():
            self._parts[name][at, envs] = values
        episodes, rows, last = [], ended.rows, {}
        if self._observed is not None and len(rows):
            last = play.turns.final_observation(CONTROLLER, step, rows).as_dict()
        for n, (row, env) in enumerate(zip(rows.tolist(), ended.envs.tolist(), strict=True)):
            length, start = int(ended.lengths[n]), self._starts[env]
            parts = {name: part[:length, env].copy() for name, part in self._parts.items()}
            observed = self._observed and self._observed.ended(env, last, n, parts["goals"])
            episode = Episode(
                start=start,
                replayer=world.replayer,
                graph=world.graph_of(start),
                variant=ended.variants[n],
                terminated=bool(step.terminated[row]),
                truncated=not step.terminated[row],
                success=bool(ended.successes[n]) if world.goals.has_target else None,
                shortest=int(ended.shortest[n]),
                observations=observed,
                **parts,
            )
            episodes.append(episode)
        for row in np.flatnonzero(step.episode_ended).tolist():
            self._starts[envs[row]] = world.get_state(row)
        if self._observed is not None:
            self._observed.see(play.turns, play.counted, envs[play.counted])
        return episodes
