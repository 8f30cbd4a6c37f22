"""What is left of a run when it ends: summary, learning curve, a picture of an episode, and a table."""

from __future__ import annotations

import shlex
from typing import Any

from rich.console import Console
from rich.table import Table

from hierroom.agents.episode import Episode
from hierroom.agents.playback import save_episodes
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.trust import trust_option
from hierroom.runs.logs.episode_log import WINDOW
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve
from hierroom.runs.logs.output import warn
from hierroom.runs.logs.plots import plot_learning_curve
from hierroom.runs.rollout import rollout
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.tables import print_table
from hierroom.turns.records import META

MANY_ILLEGAL = 0.1
"""A meta-controller whose share of illegal goals is above that may not do what it is meant to."""
N_PICTURED = 20
"""Episodes that are played for the picture of one of them."""


def write_results(trainer: Trainer, folder: RunFolder, console: Console) -> None:
    """Write the summary and pictures, and print the results."""
    curve, summary = LearningCurve.of_rows(folder.evaluations.read()), trainer.summary()
    for milestone in MILESTONES:
        crossing = curve and curve.crossing(milestone)
        summary |= {f"{name}_to_{milestone}": crossing and getattr(crossing, name) for name in ("steps", "seconds")}
    if curve is not None:
        summary |= {"evaluated_success_rate": float(curve.success[-1]), "evaluated_length": float(curve.length[-1])}
    folder.save_summary(summary)
    picture, quoted = folder.path / "learning_curve.png", shlex.quote(str(folder.path)) + trust_option(trainer.config)
    plot_learning_curve(folder, curve, picture)
    console.print(folder.path.name, soft_wrap=True, markup=False)
    print_table(_table(trainer.config, curve, summary), console)
    if (share := trainer.metrics().get("meta_illegal_goals", 0.0)) > MANY_ILLEGAL:
        warn(f"{share:.0%} of the goals given in the episodes under way were not legal, and counted as no goal")
    agent = TrainedAgent(trainer.config, trainer.agents[META], trainer.controller, trainer.steps, path=folder.path)
    episode = telling_episode(agent, (trainer.config.seed + 1) % 2**63)
    name, other = ("escape", "failure") if episode.success else ("failure", "escape")
    save_episodes([episode], folder.path / f"{name}.gif")
    (folder.path / f"{other}.gif").unlink(missing_ok=True)  # of a run that has gone on since
    none = "" if episode.success else f" (no escape in {N_PICTURED} episodes)"
    failures = "" if episode.success else " --failures"
    console.print(f"learning curve  {picture}", soft_wrap=True, markup=False)
    console.print(f"{f'one {name}':<15} {folder.path / f'{name}.gif'}{none}", soft_wrap=True, markup=False)
    console.print(f"watch it        python -m hierroom watch {quoted}{failures}", soft_wrap=True, markup=False)
    console.print(f"evaluate it     python -m hierroom evaluate {quoted}", soft_wrap=True, markup=False)


def telling_episode(agent: TrainedAgent, seed: int, episodes: int = N_PICTURED) -> Episode:
    """The first episode of some in which an agent escapes, or the first of all if it never does.

    Args:
        agent: who plays, in environments like those it was trained in.
        seed: of the levels and the actions.
        episodes: how many are tried.
    """
    played = list(rollout(agent, None, episodes, num_envs=episodes, seed=seed))
    return next((episode for episode in played if episode.success), played[0])


def _table(config: TrainConfig, curve: LearningCurve | None, summary: dict[str, Any]) -> Table:
    table = Table(show_header=False)
    table.add_column("")
    table.add_column("", justify="right")
    if curve is not None:
        table.add_row(f"success, evaluated over {config.evaluation_episodes} episodes", f"{curve.success[-1]:.1%}")
        table.add_row("episode length, evaluated", f"{curve.length[-1]:.1f}")
    table.add_row(
        f"success, last {min(WINDOW, summary['episodes'])} episodes of training", f"{summary['success_rate']:.1%}"
    )
    table.add_row("steps", f"{summary['steps']:,}")
    for milestone in MILESTONES if curve is not None else ():
        crossing = summary[f"steps_to_{milestone}"]
        table.add_row(f"steps to {milestone}% success, evaluated", "-" if crossing is None else f"{crossing:,.0f}")
    if "stage" in summary:
        table.add_row("stage of the curriculum", f"{summary['stage']} of {summary['stages']}")
    table.add_row("seconds of training", f"{summary['seconds']:.1f}")
    table.add_row("seconds of compilation", f"{summary['compile_seconds']:.1f}")
    table.add_row("steps per second", f"{summary['steps_per_second']:,.0f}")
    table.add_row("memory of the rollout", f"{summary['rollout_bytes'] / 2**20:.1f} MiB")
    return table
