"""Replay episodes of a task from their seed, name their goals and draw them."""

from __future__ import annotations

import textwrap
from collections.abc import Container, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import NO_GOAL
from hierroom.support.errors import InputError
from hierroom.support.pictures import side_by_side
from hierroom.worlds.base_view import episode_states
from hierroom.worlds.dependencies import Dependencies
from hierroom.worlds.env_config import SPLITS
from hierroom.worlds.task.local_envs import LocalEnvs
from hierroom.worlds.task.parts import TaskParts

PAPER, INK, FADED, DONE = (255, 255, 255), (20, 20, 20), (150, 150, 150), (0, 120, 60)
_WIDTH, _LINE, _MARGIN, _TITLE_LINES = 260, 18, 10, 3


@dataclass(frozen=True)
class Moment:
    """The state of one environment of a task, without the user's environment itself.

    Args:
        identity: determines the episode: seed, environment, episode number and set of levels.
        max_steps: steps after which the episode is truncated.
        counts: [G] how often each goal was achieved.
        marking: [F] the count of each fact of the rules.
        steps: steps of the episode.
        frame: its picture [H, W, 3] uint8, or in words why there is none.
    """

    identity: tuple[int, int, int, str | None]
    max_steps: int
    counts: NDArray[np.integer]
    marking: NDArray[np.integer]
    steps: int
    frame: NDArray[np.uint8] | str = "the environment was not asked to draw this state"


def seeds_of(episodes: NDArray[np.integer], levels: str | None) -> list[int]:
    """Return the seeds with which the environments of episodes are reset: [M, 3] seed, environment and number."""
    return (episode_states(episodes, 1, SPLITS[levels], 0)[:, 0] & np.uint64(0xFFFFFFFF)).tolist()


def _frame_of(envs: LocalEnvs) -> NDArray[np.uint8] | str:
    try:
        return envs.render(0)
    except InputError as error:
        return str(error)


class TaskReplayer:
    """The `Replayer` of a task; a state is a `Moment`.

    A pickled one cannot `replay`: it leaves out the task, as other processes may not find its functions.

    Attributes:
        no_picture: why an environment could not draw its first picture. None is asked again, because graphics libraries
            may abort the process at a second try.
    """

    def __init__(self, task: TaskParts) -> None:
        self._task: TaskParts | None = task
        self._name, self._goals, self._rules = task.name, task.goal_set, task.rules
        self._actions = task.trial.actions
        self.no_picture = ""

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_task": None}

    def __deepcopy__(self, memo: object) -> TaskReplayer:
        """Return itself, as it never changes except for `no_picture`."""
        return self

    def identity(self, state: Moment) -> tuple[int, int, int]:
        """Return the environments' seed, this one's index, and the number of episodes that it began before."""
        return state.identity[:3]

    def max_steps(self, state: Moment) -> int:
        """Return the number of steps after which the episode is truncated."""
        return state.max_steps

    def goal_name(self, state: Moment, goal: int) -> str:
        """Return the name of a goal."""
        return "no goal" if goal == NO_GOAL else self._goals.names[goal]

    goal_label = goal_name

    def action_name(self, state: Moment, action: Any) -> str:
        """Return the name of an action."""
        return self._actions.name(action)

    def replay(self, state: Moment, actions: NDArray, drawn: Container[int] | None = None) -> Iterator[Moment]:
        """Yield the state, then the state after each action; see `Replayer.replay`."""
        if self._task is None:
            raise InputError(f"an episode of {self._name} that was pickled has no environment to replay it in")
        drawn = range(len(actions) + 1) if drawn is None else drawn
        envs = LocalEnvs(self._task, 1, "rgb_array" if drawn else None)
        counts, markings = np.zeros_like(state.counts), state.marking[None].copy()
        dependencies, has_drawn = Dependencies.of(self._rules, self._goals), False
        try:
            _, totals = envs.reset([0], seeds_of(np.array([state.identity[:3]]), state.identity[3]))
            for step in range(len(actions) + 1):
                moment = Moment(state.identity, state.max_steps, counts.copy(), markings[0].copy(), step)
                if step in drawn:
                    moment = replace(moment, frame=self.no_picture or _frame_of(envs))
                    if isinstance(moment.frame, str) and not has_drawn:
                        self.no_picture = moment.frame
                    has_drawn = True
                yield moment
                if self._actions.are_legal(action := actions[step : step + 1]).any():
                    before = totals.astype(np.int64)
                    totals = envs.step([0], self._actions.for_envs(action)).totals
                    times = np.maximum(totals - before, 0)
                    counts = counts + times[0]
                    if dependencies is not None:
                        dependencies.apply(markings, times)
        finally:
            envs.close()

    def rules_state(self, state: Moment) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
        """Return whether each goal [G] was achieved, and the count of each fact [F]."""
        return state.counts > 0, state.marking

    def tile_size(self, state: Moment) -> int:
        """Return 1: pictures of a task have no tiles."""
        return 1

    window_tile_size = tile_size

    def picture(self, state: Moment, goal: int, tile_size: int, title: str = "") -> NDArray[np.uint8]:
        """Draw a state [H, W, 3] uint8: the environment's picture, with the goals next to it."""
        frame, most = state.frame, replace(state, counts=np.full_like(state.counts, 999))
        if isinstance(frame, str):
            raise InputError(frame)
        widest = max((text for text, _ in self._lines(most, goal)), key=len, default="")  # gives all pictures one size
        return side_by_side(frame, _panel(tuple(self._lines(state, goal)), widest, title))

    def text(self, state: Moment, goal: int = NO_GOAL) -> str:
        """Describe a state for a terminal."""
        return "\n".join(text for text, _ in self._lines(state, goal))

    def _lines(self, state: Moment, goal: int) -> Iterator[tuple[str, tuple[int, int, int]]]:
        for number, name in enumerate(self._goals.names):
            count = int(state.counts[number])
            times = f" x{count}" if count > 1 else ""
            needs = "" if self._rules is None else _needs(self._rules.rules[name])
            line = f"{'>' if number == goal else ' '} {'[x]' if count else '[ ]'} {name}{times}{needs}"
            yield line, DONE if count else INK if number == goal else FADED


def _needs(ways: Any) -> str:
    words = []
    for way in ways:
        asked = {**way.uses, **{fact: max(n, way.uses.get(fact, 0)) for fact, n in way.needs.items()}}
        words.append(", ".join(fact if n == 1 else f"{n} {fact}" for fact, n in asked.items()))
    return f"  <- {' or '.join(words)}" if any(words) else ""


@lru_cache(maxsize=256)
def _panel(lines: tuple[tuple[str, tuple[int, int, int]], ...], widest: str, title: str) -> NDArray[np.uint8]:
    from PIL import Image, ImageDraw, ImageFont

    heading = [*textwrap.wrap(title, 40), *[""] * _TITLE_LINES][:_TITLE_LINES]
    rows = [*((text, INK) for text in heading), *lines]
    font = ImageFont.load_default(size=12)
    width = max(_WIDTH, int(font.getlength(widest)) + 2 * _MARGIN)
    panel = Image.new("RGB", (width, 2 * _MARGIN + _LINE * len(rows)), PAPER)
    draw = ImageDraw.Draw(panel)
    for n, (text, colour) in enumerate(rows):
        draw.text((_MARGIN, _MARGIN + n * _LINE), text, fill=colour, font=font)
    return np.asarray(panel)
