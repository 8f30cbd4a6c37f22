"""Recording the episodes that a player plays."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from hierroom.agents.episode import Episode
from hierroom.agents.player import PlayedStep, Player, play
from hierroom.turns.records import NO_OUTCOME
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.layout import State

STEP = np.dtype(
    [
        ("actions", "i1"),
        ("rewards", "f8"),
        ("extrinsic", "f8"),
        ("goals", "i1"),
        ("achieved", "i1"),
        ("outcomes", "i1"),
    ]
)
"""What is recorded of one step in one environment, by the names that it has in `Episode`."""


def record(
    turns: Turns, player: Player, episodes: int, progress: Callable[[int], object] = lambda done: None
) -> Iterator[Episode]:
    """Let a player play the first episodes of each environment, and yield them in a fixed order.

    The order is that of the environments, first everyone's first episode, then everyone's second. It does not depend on
    how long episodes last, so the first K of them are as good a sample as all.

    Args:
        turns: N fresh environments, which begin their next episode by themselves.
        player: who plays.
        episodes: how many in all; each environment plays equally many, or the first ones one more.
        progress: called with the number of episodes played.
    """
    tape, finished, n_yielded, n = _Tape(turns), {}, 0, len(turns)
    for played in play(turns, player, episodes, progress):
        for number, env, episode in tape.add(played):
            finished[number, env] = episode
        while (place := divmod(n_yielded, n)) in finished:
            yield finished.pop(place)
            n_yielded += 1


class _Tape:
    """The steps of the episodes under way.

    Args:
        turns: N fresh environments.
    """

    def __init__(self, turns: Turns) -> None:
        self._sampler = turns.sampler
        self._steps = np.zeros((64, len(turns)), STEP)
        self._starts: list[State] = [turns.world.get_state(env) for env in range(len(turns))]

    def add(self, played: PlayedStep) -> Iterator[tuple[int, int, Episode]]:
        """Note a step; yields the counted episodes that it ended, with their number and environment."""
        step, envs, at = played.step, played.envs, played.step.lengths - 1
        if at.max() >= len(self._steps):
            self._steps = np.concatenate([self._steps, np.zeros_like(self._steps)])
        noted = np.zeros(len(envs), STEP)
        noted["actions"], noted["goals"], noted["achieved"] = step.actions, step.goals, step.events
        noted["rewards"], noted["extrinsic"] = step.rewards, step.extrinsic
        noted["outcomes"] = np.where(step.option_ended, step.outcomes, NO_OUTCOME)
        self._steps[at, envs] = noted
        for row in played.ended.tolist():
            steps, start = self._steps[: step.lengths[row], envs[row]], self._starts[envs[row]]
            yield (
                int(played.played[row]),
                int(envs[row]),
                Episode(
                    start=start,
                    graph=self._sampler.graphs_of(start.levels)[0],
                    terminated=bool(step.terminated[row]),
                    truncated=bool(step.truncated[row]) and not step.terminated[row],
                    shortest=int(step.shortest[row]),
                    **{name: np.ascontiguousarray(steps[name]) for name in STEP.names or ()},
                ),
            )
        for row in np.flatnonzero(step.episode_ended).tolist():
            self._starts[envs[row]] = played.turns.world.get_state(row)
