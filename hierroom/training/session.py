"""A training session: begins or resumes a run, trains, and writes its results."""

from __future__ import annotations

import shlex
import sys
from collections import deque
from pathlib import Path

import torch
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.errors import DivergenceError, InputError
from hierroom.meta import unsaved_memory
from hierroom.options import META
from hierroom.training.assembly import evaluation_seed
from hierroom.training.config import TrainConfig
from hierroom.training.events import Events
from hierroom.training.interrupt import Interrupt
from hierroom.training.learning_curve import LearningCurve, evaluation_points, evaluation_rows
from hierroom.training.plain_state import plain_state
from hierroom.training.provenance import record_session
from hierroom.training.results import write_results
from hierroom.training.run_folder import RunFolder, claim_folder
from hierroom.training.run_name import run_name
from hierroom.training.trainer import Trainer

ROWS_PER_RUN, CHECKPOINTS_PER_RUN = 500, 10


def begin(config: TrainConfig, out: Path | None) -> tuple[Trainer, RunFolder]:
    """Create a new run.

    Args:
        config: config of the run.
        out: folder of the run, new or empty; None: a new folder in ``runs/``, called `run_name` of the config.

    Raises:
        InputError: if a value of the config cannot be used, or the folder cannot be created.
    """
    config.to_dict()  # what cannot be written down is refused before anything is made
    trainer = Trainer(config)
    _try_out(trainer)
    folder = RunFolder.create(out or claim_folder(Path("runs") / run_name(config)), config)
    _record(folder, config)
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
    _record(folder, config)
    return trainer, folder


def run_session(trainer: Trainer, folder: RunFolder) -> int:
    """Train until the end or an interrupt and print the results; returns the exit code of the command."""
    torch.set_num_threads(1)  # more threads gain nothing at these sizes
    console = Console()
    console.print(escape(f"{trainer.config.title}, into {folder.path}"), soft_wrap=True)
    for line in trainer.turns.sampler.stage_titles:
        console.print(escape(line), soft_wrap=True)
    meta = trainer.agents[META]
    if isinstance(meta, ScriptedAgent) and (unsaved := unsaved_memory(meta.meta)):
        name = trainer.config.resolved_method.meta
        console.print(
            f"warning: the meta-controller {name} has {unsaved}, but not both state_dict and load_state_dict: what it "
            "remembers is not saved, so resuming, evaluating and watching begin without it",
            markup=False,
            soft_wrap=True,
        )
    with Interrupt() as interrupt:
        train(trainer, folder, console, interrupt)
    if not trainer.is_done:
        console.print("stopped and saved; go on with:")
        console.print(
            f"python -m hierroom.train --resume {shlex.quote(str(folder.path))}", soft_wrap=True, markup=False
        )
        return 130
    write_results(trainer, folder, console)
    return 0


def train(trainer: Trainer, folder: RunFolder, console: Console, interrupt: Interrupt) -> None:
    """Train until the end or an interrupt, with a progress bar, tables, TensorBoard events and checkpoints.

    Raises:
        DivergenceError: if training diverges; the checkpoints are as they were.
    """
    config = trainer.config
    total, sampler = config.steps, trainer.turns.sampler
    next_row, next_checkpoint = trainer.steps, trainer.steps + total // CHECKPOINTS_PER_RUN
    evaluated_at = max((int(row["steps"]) for row in folder.evaluations.read()), default=-1)
    points = deque(point for point in evaluation_points(total, config.evaluations) if point > evaluated_at)
    evaluated = ""
    columns = (
        TextColumn("{task.percentage:3.0f}%"),
        BarColumn(),
        TextColumn("{task.fields[status]}"),
        TimeRemainingColumn(compact=True),
        TextColumn("left"),
    )
    with Progress(*columns, console=console) as bar, Events(folder.path, config) as events:
        task = bar.add_task("", total=total, completed=trainer.steps, status="the first run compiles,")
        is_last = trainer.is_done
        while True:
            if points and (trainer.steps >= points[0] or trainer.is_done):
                while points and points[0] <= trainer.steps:
                    points.popleft()
                evaluation = trainer.evaluate()
                folder.evaluations.append(evaluation_rows(trainer.steps, trainer.seconds, evaluation))
                events.add_evaluation(trainer.steps, evaluation)
                evaluated = f" (evaluated {evaluation.success_rate:.0%})"
            if trainer.steps and (trainer.steps >= next_checkpoint or is_last):
                next_checkpoint += total // CHECKPOINTS_PER_RUN
                folder.save_checkpoint(trainer.state_dict())
            if is_last:
                break
            try:
                trainer.advance()
            except DivergenceError as error:
                raise DivergenceError(f"{error}. {_way_back(folder)}") from error
            is_last = trainer.is_done or interrupt.is_requested
            row = trainer.metrics()
            stage = f"stage {row['stage']:.0f} of {sampler.n_stages}, " if "stage" in row else ""
            length = "" if stage else f" length {row['episode_length']:.0f},"  # they fit into 80 columns
            success = f"success {row['success_rate']:.0%}{evaluated}"
            status = f"{row['steps_per_second']:,.0f} steps/s, {stage}{success},{length}"
            bar.update(task, completed=min(trainer.steps, total), status=status)
            folder.episodes.append(trainer.log.ended)
            if trainer.steps >= next_row or is_last:
                next_row += total // ROWS_PER_RUN
                folder.metrics.append([row])
                events.add_metrics(row)
        if trainer.is_done:
            events.add_hyperparameters(LearningCurve.of_rows(folder.evaluations.read()))


def _way_back(folder: RunFolder) -> str:
    """What to do with a run that has diverged; resuming it as it is would repeat the same numbers."""
    steps, path = folder.load_checkpoint()["steps"], shlex.quote(str(folder.path))
    begin_again = f"--config {path}/config.json" + (f" --warm-start {path}" if steps else "")
    return f"The checkpoint after {steps:,} steps is kept; begin again with {begin_again} and what is to change"


def _try_out(trainer: Trainer) -> None:
    """Take one step elsewhere and look at the state to save: a user's own code is to fail before a folder is made.

    Raises:
        InputError: if its own code says or returns something that cannot be used.
    """
    seed = evaluation_seed(trainer.config.seed)
    trainer.freeze(1, seed=seed).step(trainer.fresh_turns(1, seed))
    plain_state(trainer.state_dict(), "the state of training")


def _record(folder: RunFolder, config: TrainConfig) -> None:
    """Write what works on the run now, and say which of the user's own modules are not what they were."""
    for line in record_session(folder.path, config):
        print(f"warning: {line}", file=sys.stderr)


def _load(trainer: Trainer, folder: RunFolder) -> None:
    """Load the newest checkpoint of a run into the trainer."""
    state = folder.load_checkpoint()
    try:
        trainer.load_state_dict(state)
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"the newest checkpoint of {folder.path} does not fit its config.json") from error
