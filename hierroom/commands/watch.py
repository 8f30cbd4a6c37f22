"""Watch a trained agent: ``python -m hierroom watch RUN``."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.console import Console
from rich.progress import Progress

from hierroom.goals import GraphSpecs
from hierroom.support.cli import read_arguments
from hierroom.support.errors import InputError, require_number
from hierroom.worlds.env_config import GRAPHS

if TYPE_CHECKING:
    from hierroom.agents.episode import Episode
    from hierroom.runs.trained_agent import TrainedAgent


@dataclass(frozen=True)
class WatchArguments:
    """Watch a trained agent play: in a window, in the terminal, or in a file.

    Without --out a window opens where there is a screen (space pauses, the right arrow takes one step, up and down
    change the speed, n shows the next episode, q ends it); elsewhere the episodes are printed as text.

    Args:
        run: the run's folder, the .safetensors file of an agent, or an agent that ships (a to g, learned-g); before
            --graph and --exclude, to which all words up to the next option belong.
        episodes: how many episodes to show.
        failures: show only episodes that did not reach the exit; see --most.
        most: the most episodes to play in search of failures.
        greedy: let the controller take its most probable action instead of drawing one.
        checkpoint: the steps of an earlier checkpoint than the newest.
        trust_run: run the code that the run's config names beside what ships with hierroom (a network, a reward, a
            meta-controller of somebody's own).
        graph: other goal graphs than those trained on, given as in training.
        exclude: goal graphs to leave out; where --graph is not given, besides those left out in training.
        size: another grid size than the one trained on.
        meta: another meta-controller for the trained controller: fixed-dfs, random, oracle, none, an entry point,
            package.module:Class or package.module:function.
        goal_mask: other goals that may be chosen: reachable, existing, seen or none.
        seed: fixes the levels and the actions; training never sees the levels, whatever its seed.
        out: write a file instead: an animation, .gif or .mp4 (which needs PyAV), text, .txt, or labelled data, .json.
            Of an episode of more than 200 steps a .gif shows the first and the last 100; an .mp4 shows all.
        text: print text even where a window could be opened.
    """

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    episodes: int = 1
    failures: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    most: int = 1000
    greedy: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    checkpoint: int | None = None
    trust_run: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    graph: Annotated[GraphSpecs, GRAPHS] = ()
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    size: int | None = None
    meta: str | None = None
    goal_mask: str | None = None
    seed: int = 0
    out: Path | None = None
    text: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def main(argv: Sequence[str]) -> int:
    """Run the command on its words."""
    arguments = read_arguments(WatchArguments, "watch", argv)
    for name in ("episodes", "most"):
        require_number(name, getattr(arguments, name), 1, 10**9, is_whole=True)
    import torch  # it takes its time, and --help needs none of it

    from hierroom.agents.playback import require_file, save_episodes
    from hierroom.runs.folder.provenance import warn_of_changed_modules
    from hierroom.runs.trained_agent import load

    torch.set_num_threads(1)  # as in training
    if arguments.out is not None:
        require_file(arguments.out)
    named = {name: getattr(arguments, name) for name in ("checkpoint", "meta", "greedy")}
    agent = load(arguments.run, **named, trust=arguments.trust_run)
    episodes, n_played = _play(agent, arguments)
    # Not before: playing imports a reward of one's own.
    warn_of_changed_modules(arguments.run, agent.config.changed(meta=None) if arguments.meta else agent.config)
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
    elif arguments.text or not _has_screen():
        _print(episodes)
    else:
        _show(episodes)
    return 0


def _play(agent: TrainedAgent, arguments: WatchArguments) -> tuple[list[Episode], int]:
    """The episodes to show, and how many were played in all."""
    from hierroom.runs.rollout import rollout

    named = {name: getattr(arguments, name) for name in ("graph", "exclude", "size", "goal_mask")}
    other = {name: value for name, value in named.items() if value not in (None, ())}
    env = agent.env(**other)
    total = arguments.most if arguments.failures else arguments.episodes
    shown, n_played = [], 0
    stderr = Console(stderr=True)
    with Progress(console=stderr, transient=True, disable=not stderr.is_terminal) as bar:
        task = bar.add_task("playing", total=total)
        played = rollout(agent, env, total, seed=arguments.seed, progress=lambda done: bar.update(task, completed=done))
        for episode in played:
            n_played += 1
            if not (arguments.failures and episode.success):
                shown.append(episode)
            if len(shown) == arguments.episodes:
                break
    return shown, n_played


def _count(n_failures: int, n_played: int) -> str:
    from hierroom.complexity.played.observed import wilson_interval

    interval = wilson_interval(1 - n_failures / n_played, n_played, level=0.95)
    rate = f"95% interval of success {interval.low:.1%} to {interval.high:.1%}"
    if not n_failures:
        return f"no failure in {n_played} episodes: {rate}; nothing to show"
    return f"{n_failures} {'failure' if n_failures == 1 else 'failures'} in the first {n_played} episodes"


def _print(episodes: Sequence[Episode]) -> None:
    from hierroom.agents.playback import description, without_colours

    words = "\n\n\n".join(description(episode) for episode in episodes)
    print(words if sys.stdout.isatty() else without_colours(words))


def _has_screen() -> bool:
    if sys.platform in ("win32", "darwin"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"))


def _show(episodes: Sequence[Episode]) -> None:
    """Show the episodes in a window, or as text if none can be opened."""
    from hierroom.agents.playback import film
    from hierroom.worlds.escape_room.render import default_tile_size
    from hierroom.worlds.escape_room.window import Window

    window = Window()
    try:
        for episode in episodes:
            print(episode.title)
            window.title = episode.title
            if window.play(film([episode], tile_size=default_tile_size(episode.start.size))) == "closed":
                break
    except InputError as error:  # no screen after all
        print(f"{str(error).partition(';')[0]}; as text:\n", file=sys.stderr)
        _print(episodes)
    finally:
        window.close()
