"""Show recorded episodes as pictures, as text and in files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.episode import Episode
from hierroom.goals import NO_GOAL, Rules
from hierroom.support.errors import InputError
from hierroom.support.files import to_json, usable_path, write_atomically
from hierroom.support.pictures import gif, side_by_side

FILE_FORMATS = (".gif", ".txt", ".json")
CARD_FRAMES = 10
"""Number of frames for an episode's end, or for a note of omitted steps: a second at the usual speed."""
MOST_IN_GIF = 200
"""Most steps of an episode in a GIF, about 400 kB."""
N_LAST_ACTIONS = 12


def without_colours(text: str) -> str:
    """Return a text without terminal colour codes."""
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


def pictures(episode: Episode, tile_size: int | None = None, most: int | None = None) -> Iterator[NDArray[np.uint8]]:
    """Draw an episode of L steps step by step; each picture names the step, its action and the subgoal.

    If the level has rules, their graph is drawn next to it: see `rules_picture`.

    Args:
        episode: the episode.
        tile_size: side length of a cell in pixels; None: large enough for the text.
        most: about how many steps of a longer episode to draw, from its start and its end. A picture between them says
            which are left out. None: all.

    Yields:
        [H, W, 3] uint8, L + 1 of them if none is left out.
    """
    limit, length = episode.replayer.max_steps(episode.start), len(episode)
    tile_size = tile_size or episode.replayer.tile_size(episode.start)
    first, last = (length, length) if most is None or length <= most + 1 else (most // 2, length - most // 2)
    drawn = {*range(first + 1), *range(last, length + 1)}
    for step, state in enumerate(episode.states(drawn)):
        if step not in drawn:
            continue
        goal = int(episode.goals[min(step, length - 1)])
        if first < step == last:
            card = _picture(episode, state, goal, tile_size, f"steps {first + 1} to {last - 1} are left out")
            yield from [card] * CARD_FRAMES
        title = f"step {step} of {limit}" + (f": {episode.action_name(step)}" if step else "")
        title += f", {episode.end}" if step == length else ""
        yield _picture(episode, state, goal, tile_size, title)


def _picture(episode: Episode, state: Any, goal: int, tile_size: int, title: str) -> NDArray[np.uint8]:
    picture, rules = episode.replayer.picture(state, goal, tile_size, title), episode.graph
    state_of = getattr(episode.replayer, "rules_state", None)
    if state_of is None or not isinstance(rules, Rules):
        return picture
    from hierroom.complexity.draw import rules_picture  # matplotlib loads slowly, and few films need it

    achieved, marking = state_of(state)
    names = [episode.replayer.goal_label(state, number) for number in np.flatnonzero(achieved).tolist()]
    pursued = None if goal == NO_GOAL else episode.replayer.goal_label(state, goal)
    return side_by_side(picture, rules_picture(rules, frozenset(names), tuple(marking.tolist()), pursued))


def description(episode: Episode) -> str:
    """Describe an episode: the level, each subgoal with its steps and outcome, and its last state if it failed.

    The text has terminal colour codes; `without_colours` removes them.
    """
    lines = [episode.title, "", episode.replayer.text(episode.start), ""]
    rows = [("step", "steps", "subgoal", "outcome", "achieved")]
    for subgoal in episode.subgoals:
        last = subgoal.first_step + subgoal.steps - 1
        achieved = [event.name for event in episode.events if subgoal.first_step <= event.step <= last]
        row = (str(subgoal.first_step), str(subgoal.steps), subgoal.name, subgoal.outcome, ", ".join(achieved) or "-")
        rows.append(row)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for step, steps, *words in rows:
        cells = [step.rjust(widths[0]), steps.rjust(widths[1])]
        cells += [word.ljust(width) for word, width in zip(words, widths[2:], strict=True)]
        lines.append("  ".join(cells).rstrip())
    if episode.success is False:
        *_, final = episode.states(drawn=())
        first = max(1, len(episode) - N_LAST_ACTIONS + 1)
        actions = ", ".join(episode.action_name(step) for step in range(first, len(episode) + 1))
        lines += [
            "",
            f"where it ended, after the actions {actions}:",
            "",
            episode.replayer.text(final, int(episode.goals[-1])),
        ]
    return "\n".join(lines)


def require_file(path: Path) -> None:
    """Check that `save_episodes` can write a file; call this before playing."""
    if path.suffix.lower() not in FILE_FORMATS:
        raise InputError(f"episodes are written as {', '.join(FILE_FORMATS)}, not as {path.name or path}")
    if not usable_path(path).parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}")


def save_episodes(episodes: Sequence[Episode], path: Path) -> None:
    """Write one or more episodes into a file: an animation (.gif), text (.txt) or data (.json).

    A GIF leaves out steps of long episodes and says which: see `pictures`.
    """
    require_file(path)
    kind = path.suffix.lower()
    if kind == ".gif":
        write_atomically(path, gif(film(episodes, most=MOST_IN_GIF)))
    elif kind == ".txt":
        words = "\n\n\n".join(description(episode) for episode in episodes)
        write_atomically(path, without_colours(words) + "\n")
    else:
        write_atomically(path, to_json([episode.to_dict() for episode in episodes]) + "\n")


def film(
    episodes: Sequence[Episode], tile_size: int | None = None, most: int | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Yield the `pictures` of several episodes one after the other; hold the end of each for a second."""
    for episode in episodes:
        frame = None
        for frame in pictures(episode, tile_size, most):
            yield frame
        if frame is not None:
            yield from [frame] * (CARD_FRAMES - 1)
