"""A training session: begins or resumes a run, trains, and writes its results."""

from __future__ import annotations

import shlex
from pathlib import Path

import torch
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from torch.utils.tensorboard import SummaryWriter

from hierroom.agents.episode import Episode
from hierroom.agents.playback import save_episodes
from hierroom.errors import InputError
from hierroom.options import META
from hierroom.training.config import TrainConfig
from hierroom.training.episode_log import MILESTONES, WINDOW
from hierroom.training.interrupt import Interrupt
from hierroom.training.plots import plot_learning_curve
from hierroom.training.rollout import rollout
from hierroom.training.run_folder import RunFolder, unused_path
from hierroom.training.trained_agent import TrainedAgent
from hierroom.training.trainer import Trainer

ROWS_PER_RUN, CHECKPOINTS_PER_RUN = 500, 10
N_PICTURED = 20
"""Episodes that are played for the picture of one of them."""


def begin(config: TrainConfig, out: Path | None) -> tuple[Trainer, RunFolder]:
    """Create a new run.

    Args:
        config: config of the run.
        out: folder of the run, new or empty; None: a folder in ``runs/`` with the name of the config.

    Raises:
        InputError: if a value of the config cannot be used, or the folder cannot be created.
    """
    trainer = Trainer(config)
    folder = RunFolder.create(out or unused_path(Path("runs") / config.name), config)
    folder.save_checkpoint(trainer.state_dict())  # so that the run can be resumed from the very start
    return trainer, folder


def resume(config: TrainConfig, path: Path) -> tuple[Trainer, RunFolder]:
    """Continue a run from its newest checkpoint.

    Args:
        config: the run's config, possibly with more steps, another number of threads or another device.
        path: folder of the run.

    Raises:
        InputError: if the checkpoint does not fit the config, or the run has already taken all steps.
    """
    trainer = Trainer(config.changed(warm_start=None))  # the checkpoint holds all weights
    folder = RunFolder.open(path)
    _load(trainer, folder)
    has_other_steps = config.steps != folder.config().steps
    if has_other_steps and trainer.steps >= config.steps:
        taken = f"{folder.path} has taken {trainer.steps:,} steps"
        raise InputError(f"{taken}; --steps must be more, not {config.steps:,}")
    for table in folder.tables:
        table.drop_after(trainer.steps)
    folder.save_config(config)  # with the new number of steps, in case it is interrupted again
    return trainer, folder


def run_session(trainer: Trainer, folder: RunFolder) -> int:
    """Train until the end or an interrupt and print the results; returns the exit code of the command."""
    torch.set_num_threads(1)  # more threads gain nothing at these sizes
    console = Console()
    console.print(f"{trainer.config.title}, into {escape(str(folder.path))}")
    with Interrupt() as interrupt:
        train(trainer, folder, console, interrupt)
    if not trainer.is_done:
        console.print("stopped and saved; go on with:")
        console.print(f"python -m hierroom.train --resume {shlex.quote(str(folder.path))}", soft_wrap=True)
        return 130
    finish(trainer, folder, console)
    return 0


def train(trainer: Trainer, folder: RunFolder, console: Console, interrupt: Interrupt) -> None:
    """Train until the end or an interrupt, with a progress bar, metrics, TensorBoard events and checkpoints."""
    total = trainer.config.steps
    next_row, next_checkpoint = trainer.steps, trainer.steps + total // CHECKPOINTS_PER_RUN
    columns = (
        TextColumn("{task.percentage:3.0f}%"),
        BarColumn(),
        TextColumn("{task.fields[status]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    with Progress(*columns, console=console) as bar, SummaryWriter(str(folder.path)) as events:
        task = bar.add_task("", total=total, completed=trainer.steps, status="the first run compiles,")
        is_last = trainer.is_done
        while not is_last:
            trainer.advance()
            is_last = trainer.is_done or interrupt.is_requested
            row = trainer.metrics()
            status = (
                f"{trainer.steps / trainer.seconds:,.0f} steps/s, success {row['success_rate']:.1%}, "
                f"length {row['episode_length']:.0f},"
            )
            bar.update(task, completed=min(trainer.steps, total), status=status)
            if trainer.steps >= next_row or is_last:
                next_row += total // ROWS_PER_RUN
                folder.metrics.append([row])
                for name, value in row.items():
                    events.add_scalar(name, value, trainer.steps)
            if trainer.steps >= next_checkpoint or is_last:
                next_checkpoint += total // CHECKPOINTS_PER_RUN
                folder.save_checkpoint(trainer.state_dict())


def finish(trainer: Trainer, folder: RunFolder, console: Console) -> None:
    """Write the summary and pictures, and print the results."""
    summary = trainer.summary()
    folder.save_summary(summary)
    curve, quoted = folder.path / "learning_curve.png", shlex.quote(str(folder.path))
    plot_learning_curve(folder, curve)
    table = Table(title=escape(folder.path.name), show_header=False)
    table.add_column("")
    table.add_column("", justify="right")
    table.add_row(f"success, last {min(WINDOW, summary['episodes'])} episodes", f"{summary['success_rate']:.1%}")
    table.add_row("episode length", f"{summary['episode_length']:.1f}")
    table.add_row("steps", f"{summary['steps']:,}")
    for milestone in MILESTONES:
        steps = summary[f"steps_to_{milestone}"]
        table.add_row(f"steps to {milestone}% success", f"{steps:,}" if steps else "-")
    table.add_row("seconds", f"{summary['seconds']:.1f}")
    table.add_row("steps per second", f"{summary['steps_per_second']:,.0f}")
    table.add_row("memory of the rollout", f"{summary['rollout_bytes'] / 2**20:.1f} MiB")
    console.print(table)
    agent = TrainedAgent(trainer.config, trainer.agents[META], trainer.controller, trainer.steps, path=folder.path)
    episode = telling_episode(agent, trainer.config.seed + 1)
    name, other = ("escape", "failure") if episode.success else ("failure", "escape")
    picture = folder.path / f"{name}.gif"
    save_episodes([episode], picture)
    (folder.path / f"{other}.gif").unlink(missing_ok=True)  # of a run that has gone on since
    console.print(f"learning curve  {curve}", soft_wrap=True)
    none = "" if episode.success else f" (no escape in {N_PICTURED} episodes)"
    console.print(f"{f'one {name}':<15} {picture}{none}", soft_wrap=True)
    console.print(
        f"watch it        python -m hierroom.watch {quoted}{'' if episode.success else ' --failures'}", soft_wrap=True
    )
    console.print(f"evaluate it     python -m hierroom.evaluate {quoted}", soft_wrap=True)


def telling_episode(agent: TrainedAgent, seed: int, episodes: int = N_PICTURED) -> Episode:
    """The first episode of some in which an agent escapes, or the first of all if it never does.

    Args:
        agent: who plays, in environments like those it was trained in.
        seed: of the levels and the actions.
        episodes: how many are tried.
    """
    played = list(rollout(agent, None, episodes, num_envs=episodes, seed=seed))
    return next((episode for episode in played if episode.success), played[0])


def _load(trainer: Trainer, folder: RunFolder) -> None:
    """Load the newest checkpoint of a run into the trainer."""
    state = folder.load_checkpoint()
    try:
        trainer.load_state_dict(state)
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"the newest checkpoint of {folder.path} does not fit its config.json") from error
