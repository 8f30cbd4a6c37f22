"""Train an agent: ``python -m hierroom.train --meta fixed-dfs``."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import torch
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from hierroom.cli import run
from hierroom.errors import InputError
from hierroom.options import META
from hierroom.training.assembly import make_turns
from hierroom.training.config import TrainConfig
from hierroom.training.episode_log import MILESTONES, WINDOW
from hierroom.training.interrupt import Interrupt
from hierroom.training.plots import plot_learning_curve
from hierroom.training.presets import PRESETS, find_preset
from hierroom.training.run_folder import RunFolder, unused_path
from hierroom.training.trainer import Trainer
from hierroom.world.animation import animate
from hierroom.world.render import draw_level

ROWS_PER_RUN, CHECKPOINTS_PER_RUN = 500, 10
_ONLY_BESIDE_RESUME = "a resumed run keeps its config; only --steps, --threads and --device may be given"


@dataclass(frozen=True)
class Arguments:
    """Train an agent in EscapeRooms and write a run folder."""

    config: Annotated[TrainConfig, tyro.conf.arg(name="")]
    preset: str | None = None
    """What the other options start from: default, long (for five million steps and the shortest ways), large (for
    grids of 31 cells and more), learned (for --meta learned, which implies it) or paper (its section 3)."""
    out: Path | None = None
    """The run folder, new; by default runs/ and the run's name."""
    resume: Path | None = None
    """A run folder to go on with; only --steps, --threads and --device may be given beside it."""


def parse(argv: list[str] | None = None) -> Arguments:
    """The arguments of the command line; unnamed options come from the preset or the run that is resumed.

    Raises:
        InputError: if the preset or the run does not exist, or a resumed run is given other options.
    """
    first = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    for name in ("--preset", "--meta", "--resume", "--out"):
        first.add_argument(name)
    try:
        known, _ = first.parse_known_args(argv)
    except argparse.ArgumentError as error:
        raise InputError(str(error)) from error
    # A meta-controller that needs other settings than the default has a preset of its own name.
    if known.resume and (known.preset is not None or known.out is not None):
        raise InputError(_ONLY_BESIDE_RESUME)
    preset = known.preset or (known.meta if known.meta in PRESETS else "default")
    default = RunFolder.open(known.resume).config() if known.resume else find_preset(preset)
    return tyro.cli(
        Arguments,
        prog="python -m hierroom.train",
        default=Arguments(config=default),
        args=argv,
    )


def main(argv: list[str] | None = None) -> int:
    """The command."""
    arguments = parse(argv)
    config, console = arguments.config, Console()
    torch.set_num_threads(1)  # more gain nothing at these sizes
    if arguments.resume:
        trainer = Trainer(replace(config, warm_start=None))  # the checkpoint holds all weights
        folder = RunFolder.open(arguments.resume)
        _check_unchanged(config, folder.config())
        _load(trainer, folder)
        if trainer.steps >= config.steps != folder.config().steps:
            taken = f"{folder.path} has taken {trainer.steps:,} steps"
            raise InputError(f"{taken}; --steps must be more, not {config.steps:,}")
        folder.drop_metrics_after(trainer.steps)
        folder.save_config(config)  # with the steps to go on to, should it be interrupted again
    else:
        trainer = Trainer(config)
        folder = RunFolder.create(arguments.out or unused_path(Path("runs") / config.name), config)
        folder.save_checkpoint(trainer.state_dict())  # so that, whatever happens now, there is something to resume
    console.print(_title(trainer, folder))
    with Interrupt() as interrupt:
        train(trainer, folder, console, interrupt)
    if not trainer.is_done:
        console.print("stopped and saved; go on with:")
        console.print(f"python -m hierroom.train --resume {shlex.quote(str(folder.path))}", soft_wrap=True)
        return 130
    finish(trainer, folder, console)
    return 0


def train(trainer: Trainer, folder: RunFolder, console: Console, interrupt: Interrupt) -> None:
    """Train to the end or an interrupt, with a progress bar, metrics, TensorBoard events and checkpoints."""
    from torch.utils.tensorboard import SummaryWriter  # slow to load, and only wanted here

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
        while not trainer.is_done and not interrupt.is_requested:
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
                folder.append_metrics(row)
                for name, value in row.items():
                    events.add_scalar(name, value, trainer.steps)
            if trainer.steps >= next_checkpoint or is_last:
                next_checkpoint += total // CHECKPOINTS_PER_RUN
                folder.save_checkpoint(trainer.state_dict())


def finish(trainer: Trainer, folder: RunFolder, console: Console) -> None:
    """Write summary and pictures and print what came out."""
    summary = trainer.summary()
    folder.save_summary(summary)
    curve, escape = folder.path / "learning_curve.png", folder.path / "escape.gif"
    plot_learning_curve(folder, curve)
    table = Table(title=trainer.config.name, show_header=False)
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
    frames = next(escapes(trainer), None)
    if frames:
        animate(frames, escape)
    console.print(f"learning curve  {curve}", soft_wrap=True)
    console.print(f"one escape      {escape if frames else 'none in 20 episodes'}", soft_wrap=True)
    console.print(f"evaluate it     python -m hierroom.evaluate {shlex.quote(str(folder.path))}", soft_wrap=True)


def escapes(trainer: Trainer, episodes: int = 20) -> Iterator[list[NDArray]]:
    """The pictures of each successful episode among the first few of a fresh environment."""
    config = replace(trainer.config, threads=1)
    pair = trainer.freeze(1, seed=config.seed)
    turns = make_turns(config, 1, config.seed + 1, whole_interval=True, autoreset=False)
    for _ in range(episodes):
        turns.reset()
        moments = []
        step = None
        while step is None or not step.episode_ended[0]:
            pair.choose(turns, META)
            moments.append((turns.world.get_state(), int(turns.goals[0])))
            step = pair.step(turns)
        moments.append((turns.world.get_state(), int(step.goals[0])))
        if step.terminated[0]:
            yield [draw_level(state, goal, tile_size=16) for state, goal in moments]


def _title(trainer: Trainer, folder: RunFolder) -> str:
    config = trainer.config
    return (
        f"{config.method} with meta-controller {config.pair.meta} on graph {config.env.graph}, seed {config.seed}: "
        f"{config.steps:,} steps in {config.num_envs} environments, into {folder.path}"
    )


def _load(trainer: Trainer, folder: RunFolder) -> None:
    """Go on from a run's newest checkpoint."""
    state = folder.load_checkpoint()
    try:
        trainer.load_state_dict(state)
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"the newest checkpoint of {folder.path} does not fit its config.json") from error


def _check_unchanged(config: TrainConfig, before: TrainConfig) -> None:
    if replace(config, steps=before.steps, threads=before.threads, device=before.device) != before:
        raise InputError(_ONLY_BESIDE_RESUME)


if __name__ == "__main__":
    run(main)
