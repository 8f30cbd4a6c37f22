"""Watch a trained agent: ``python -m hierroom watch RUN``."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hierroom.commands.agent_arguments import AgentArguments
from hierroom.support.cli import Flag, given, progress_bar, read_arguments, refuse_without
from hierroom.support.errors import InputError, require_number

if TYPE_CHECKING:
    from hierroom.agents.episode import Episode
    from hierroom.runs.trained_agent import TrainedAgent


@dataclass(frozen=True)
class WatchArguments(AgentArguments):
    """Watch a trained agent play: in a window, in the terminal, or in a file.

    Without --out, a window opens if there is a screen; otherwise the episodes are printed as text. Keys: space
    pauses, the right arrow takes one step, up and down change the speed, n shows the next episode, q quits.

    Args:
        episodes: number of episodes to show.
        failures: show only episodes that did not reach their target, such as the exit; see --most.
        most: the most episodes to play to find failures; by default 1000.
        greedy: let the controller take its most probable action instead of drawing one.
        out: write a file instead: an animation (.gif), text (.txt) or labelled data (.json). A .gif shows only the
            first and the last 100 steps of an episode of more than 200.
        text: print text even if a window could be opened.
    """

    episodes: int = 1
    failures: Flag = False
    most: int | None = None
    greedy: Flag = False
    out: Path | None = None
    text: Flag = False


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(WatchArguments, "watch", argv)
    for name, number in given(arguments, "episodes", "most").items():
        require_number(name, number, 1, 10**9, is_whole=True)
    refuse_without(arguments, "failures", "most")
    if arguments.text and arguments.out is not None:
        raise InputError("--text prints the episodes, and --out writes them to a file; leave one out")
    from hierroom.agents.playback import require_file, save_episodes
    from hierroom.worlds.make import world_spec
    from hierroom.worlds.window import has_screen

    if arguments.out is not None:
        require_file(arguments.out)
    agent = arguments.load(arguments.greedy)
    if arguments.failures and not world_spec(agent.config.env).goals.has_target:
        raise InputError(f"{agent.config.env.names[0]} has no target, so --failures finds none; leave it out")
    episodes, n_played = _play(agent, arguments)
    arguments.warn_of_changes(agent)
    if arguments.failures:
        print(_count(len(episodes), n_played))
        pursued = Counter(episode.subgoals[-1].label for episode in episodes)
        if len(episodes) > 1:
            print("they ended in pursuit of: " + ", ".join(f"{goal} ({n})" for goal, n in pursued.most_common()))
    if not episodes:
        return 0
    if arguments.out is not None:
        save_episodes(episodes, arguments.out)
        for episode in episodes:
            print(episode.title)
        print(arguments.out)
    elif not arguments.text and has_screen():
        _show(episodes)
    else:
        _print(episodes)
    return 0


def _play(agent: TrainedAgent, arguments: WatchArguments) -> tuple[list[Episode], int]:
    from hierroom.runs.rollout import rollout

    total = (arguments.most or 1000) if arguments.failures else arguments.episodes
    shown, n_played = [], 0
    with progress_bar() as bar:
        task = bar.add_task("playing", total=total)
        env, seed = arguments.env(agent), arguments.seed
        for episode in rollout(agent, env, total, seed=seed, progress=lambda done: bar.update(task, completed=done)):
            n_played += 1
            if not (arguments.failures and episode.success):
                shown.append(episode)
            if len(shown) == arguments.episodes:
                break
    return shown, n_played


def _count(n_failures: int, n_played: int) -> str:
    from hierroom.support.intervals import wilson_interval

    if n_failures:
        return f"{n_failures} failure{'s' * (n_failures > 1)} in the first {n_played} episodes"
    interval = wilson_interval(1.0, n_played, level=0.95)
    rate = f"95% interval of success {interval.low:.1%} to {interval.high:.1%}"
    return f"no failure in {n_played} episodes: {rate}; nothing to show"


def _print(episodes: Sequence[Episode]) -> None:
    from hierroom.agents.playback import description, without_colours

    words = "\n\n\n".join(map(description, episodes))
    print(words if sys.stdout.isatty() else without_colours(words))


def _show(episodes: Sequence[Episode]) -> None:
    from hierroom.agents.playback import film
    from hierroom.worlds.window import Window

    window = Window()
    try:
        for episode in episodes:
            print(episode.title)
            window.title = episode.title
            tile_size = episode.replayer.window_tile_size(episode.start)
            if window.play(film([episode], tile_size=tile_size)) == "closed":
                break
    except InputError as error:  # no screen can be used
        print(f"{str(error).partition(';')[0]}; as text:\n", file=sys.stderr)
        _print(episodes)
    finally:
        window.close()
