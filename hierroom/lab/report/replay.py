"""Episodes for the page's replay: each step as numbers, from which the browser draws the level, and the decisions."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from itertools import pairwise, zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.episode import Episode
from hierroom.agents.playback import MOST_IN_GIF, pictures
from hierroom.agents.player import Pair
from hierroom.agents.recorder import record
from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, NO_GOAL
from hierroom.goals.tree import tree_places
from hierroom.lab.report.curves import rounded
from hierroom.learners.policy import Decision
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.support.errors import InputError
from hierroom.support.pictures import gif
from hierroom.turns.records import CONTROLLER, META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.constants import EXIT, KEY, LOCKED_DOOR, MARGIN, OPEN_DOOR, UNSEEN, WALL
from hierroom.worlds.escape_room.render import ACTION_NAMES, view_of
from hierroom.worlds.escape_room.rooms import rooms_of

LETTERS = "0123456789abcdefghijklmnopqrstuvwxyz"  # tile codes on the page, from 0
TILES = {
    "letters": LETTERS,
    "unseen": UNSEEN,
    "exit": EXIT,
    "key": KEY,
    "open_door": OPEN_DOOR,
    "locked_door": LOCKED_DOOR,
    "wall": WALL,
    "colours": list(COLOURS),
    "actions": list(ACTION_NAMES.values()),
}
"""Facts about tiles and actions for the page."""
N_TRIED = 20  # least number of episodes played, from which those on the page are chosen


class DecisionTape:
    """A player: a pair of agents that plays in N new environments, and a record of all its decisions."""

    def __init__(self, pair: Pair) -> None:
        self._pair = pair
        self._taken: dict[str, list[tuple[int, NDArray[np.integer], NDArray, NDArray]]] = {}
        self._last: dict[str, Decision | None] = {}
        self._n_steps = 0

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every environment."""
        step = self._pair.step(turns)
        for name, agent in self._pair.agents.items():
            decision: Decision | None = getattr(agent, "decision", None)  # scripted agents have none
            if decision is not None and decision is not self._last.get(name):
                kept = decision.envs.copy(), decision.probabilities, decision.values.copy()
                self._taken.setdefault(name, []).append((self._n_steps, *kept))
                self._last[name] = decision
        self._n_steps += 1
        return step

    def of_first_episode(self, name: str, env: int, length: int) -> dict[str, Any] | None:
        """Return an agent's T decisions in an environment's first episode, given its length; None if scripted.

        They are the ``steps`` [T] where its turns began, counted from 0, the ``probabilities`` [T, A] of its actions,
        and the ``values`` [T], the discounted returns that it expected.
        """
        found = [
            (at, rounded(probabilities[row], 3), values[row])
            for at, envs, probabilities, values in self._taken.get(name, ())
            if at < length
            for row in np.flatnonzero(envs == env)
        ]
        steps, probabilities, values = zip(*found, strict=True) if found else ((), (), ())
        return {"steps": steps, "probabilities": probabilities, "values": rounded(values, 4)} if found else None


def replays(agent: TrainedAgent, episodes: int, seed: int) -> list[dict[str, Any]]:
    """Play episodes and return some as plain types; a success and a failure of each graph come first, if there are any.

    The page draws levels from numbers; for a task it shows a film.
    """
    n = max(N_TRIED, episodes)
    pair, is_film = agent.pair(n, seed=seed), agent.config.env.task is not None
    tape = DecisionTape(pair)
    played = list(record(agent.turns(n, seed=seed), pair if is_film else tape, n))
    chosen = _chosen(played, episodes)
    if is_film:
        return [filmed(played[env]) for env in chosen]
    return [
        replay(played[env], *(tape.of_first_episode(name, env, len(played[env])) for name in (CONTROLLER, META)))
        for env in chosen
    ]


def filmed(episode: Episode) -> dict[str, Any]:
    """Return an episode as a film (a GIF in base64), or why there is none, and its subgoals."""
    film = no_film = ""
    try:
        film = base64.b64encode(gif(pictures(episode, most=MOST_IN_GIF))).decode()
    except InputError as error:
        no_film = str(error)
    subgoals = [vars(subgoal).copy() for subgoal in episode.subgoals]
    return {"title": episode.title, "film": film, "no_film": no_film, "subgoals": subgoals}


def _chosen(played: Sequence[Episode], n: int) -> list[int]:
    firsts: dict[tuple[bool | None, str], int] = {}
    for number, episode in enumerate(played):
        firsts.setdefault((episode.success, episode.variant), number)
    ends = [[number for (success, _), number in firsts.items() if success is wanted] for wanted in (True, False)]
    order = [number for pair in zip_longest(*ends) for number in pair if number is not None]
    return [*order, *(number for number in range(len(played)) if number not in order)][:n]


def replay(
    episode: Episode, controller: dict[str, Any] | None = None, meta: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return an episode of L steps as plain types, with its agents' decisions, to draw each of its L + 1 states."""
    states = list(episode.states())
    first, size = states[0].levels[0], episode.start.size
    colours = first.colours[: int(first.n_rooms) - 1].tolist()
    tiles = [state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN].ravel() for state in states]
    levels = np.concatenate([state.levels for state in states])
    return {
        "title": episode.title,
        "graph": {
            "name": episode.variant,
            "key_rooms": list(episode.graph.key_rooms),
            "exit_room": episode.graph.exit_room,
            "places": [list(place) for place in tree_places(episode.graph.key_rooms)],
        },
        "size": size,
        "limit": int(first.max_steps),
        "success": episode.success,
        "colours": colours,
        "tiles": _letters(tiles[0]),
        "changes": [
            [[int(cell), int(now[cell])] for cell in np.flatnonzero(before != now)] for before, now in pairwise(tiles)
        ],
        "views": [_letters(view_of(state).ravel()) for state in states],
        **{f"{name}s": (levels[name] - MARGIN).tolist() for name in ("row", "col")},
        "directions": levels["direction"].tolist(),
        **{name: levels[name].tolist() for name in ("keys", "doors")},
        "rooms": rooms_of(levels, episode.start.maps).tolist(),
        **{name: getattr(episode, name).tolist() for name in ("actions", "goals", "achieved")},
        "rewards": rounded(episode.rewards, 3),
        "subgoals": [vars(subgoal).copy() for subgoal in episode.subgoals],
        "names": {
            str(goal): episode.name_of(goal)
            for goal in (NO_GOAL, *colours, *(FIRST_DOOR_GOAL + colour for colour in colours), EXIT_GOAL)
        },
        "controller": controller,
        "meta": meta,
    }


def _letters(tiles: NDArray[np.uint8]) -> str:
    return "".join(LETTERS[tile] for tile in tiles.tolist())
