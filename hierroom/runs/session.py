"""A training session: begins or resumes a run, trains, and writes its results."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, chdir, closing, contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from hierroom.agents.evaluation import outcome_in_words
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent, unsaved_memory
from hierroom.learners.networks.initial_weights import torch_threads
from hierroom.learners.networks.input_layer import reads_pictures
from hierroom.runs.assembly import derived_seed
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.run_name import run_name
from hierroom.runs.decisions import decide, episodes_now, speed_in_words
from hierroom.runs.folder import checkpoint
from hierroom.runs.folder.predicted import keep_prediction, prediction_of
from hierroom.runs.folder.provenance import misfits_explained, record_session
from hierroom.runs.folder.run_folder import RunFolder, claim_folder
from hierroom.runs.folder.user_code import named_code, trust_option
from hierroom.runs.folder.weights import digest
from hierroom.runs.logs.learning_curve import LearningCurve, evaluation_points, evaluation_rows
from hierroom.runs.logs.logs import DEFAULT, NONE, Logs
from hierroom.runs.logs.scalars import evaluation_scalars, metric_scalars
from hierroom.runs.results import write_results
from hierroom.runs.trainer import Trainer
from hierroom.support.cli import shell_words
from hierroom.support.errors import DivergenceError, InputError, RunError
from hierroom.support.files import to_json
from hierroom.support.interrupt import Interrupt, awaited
from hierroom.support.output import is_quiet, lasting_output, warn
from hierroom.turns.records import META

ROWS, CHECKPOINTS = 500, 10
"""Rows of ``metrics.csv`` that a run writes, without the one after the first update, and number of checkpoints."""

Callback = Callable[[Trainer], object]
"""Called after each update; a true value stops the run."""


def begin(config: TrainConfig, out: Path | None, variant: str = "") -> tuple[Trainer, RunFolder]:
    """Create a run and lock it until `run_session` returns; ``variant`` is its name in the plan of a sweep.

    ``out`` is its folder, new or empty; by default, a new folder in ``runs/`` named by `run_name`.
    """
    TrainConfig.from_dict(json.loads(to_json(config.to_dict())))  # refuse now a config that could not be read back
    name, config = run_name(config), decide(config)
    trainer = Trainer(config)
    if named_code(config):
        _try_out(trainer)
    folder = RunFolder.create(out or claim_folder(Path("runs") / name), config)
    with ExitStack() as stack:
        stack.enter_context(folder.lock)
        keep_prediction(config, folder.path)
        _record(folder, trainer, variant)
        folder.save_checkpoint(trainer.state_dict())  # so that the run can be resumed from the very start
        folder.load_checkpoint()  # notice now if the disk loses data
        stack.pop_all()  # `run_session` releases it
    return trainer, folder


def resume(config: TrainConfig, path: Path, variant: str = "") -> tuple[Trainer, RunFolder]:
    """Lock a run and continue from its newest checkpoint; only steps, threads and device of its config may differ.

    ``variant`` is as in `begin`, which may have been killed before it wrote that.
    """
    folder = RunFolder.open(path)
    with ExitStack() as stack:
        stack.enter_context(folder.lock)
        folder.tidy()
        began = folder.config()
        config = config.changed(film=began.film, evaluation_steps=began.evaluation_steps)  # decided when it began
        is_untrained = folder.is_untrained
        trainer = Trainer(config, begins=is_untrained)
        state = None if is_untrained else folder.load_checkpoint()
        if state is not None:
            folder.require_same_config(config, state)
            with misfits_explained(path, config, f"the newest checkpoint of {path} does not fit its config.json"):
                trainer.load_state_dict(state)
        if trainer.steps >= config.steps != folder.config().steps:
            taken = f"{folder.path} has taken {trainer.steps:,} steps"
            raise InputError(f"{taken}; --steps must be more, not {config.steps:,}")
        if state is not None:
            _warn_of_learning_rates(trainer, folder.config().steps)
            folder.keep_rows(state)
        folder.save_config(config)  # with the new number of steps, in case it is interrupted again
        _record(folder, trainer, variant)
        if state is None:
            folder.save_checkpoint(trainer.state_dict())
        stack.pop_all()
    return trainer, folder


def _warn_of_learning_rates(trainer: Trainer, steps: int) -> None:
    """Warn of each agent with a learning rate that jumps, because its schedule now ends at another number of steps."""
    ends = trainer.steps / steps, trainer.steps / trainer.config.steps
    for name, agent in trainer.agents.items():
        if isinstance(agent, PPOAgent) and steps != trainer.config.steps:
            was, now = (agent.learner.config.learning_rate_at(min(progress, 1.0)) for progress in ends)
            if was != now:
                over = f"it falls over {trainer.config.steps:,} steps now, and did over {steps:,}"
                warn(f"the learning rate of {name} goes on at {now:.1e} after {was:.1e}: {over}")


def run_session(
    trainer: Trainer, folder: RunFolder, log: Sequence[str] = DEFAULT, callback: Callback | None = None
) -> int:
    """Train until the end, an interrupt or the callback's stop, and print results even into a closed stream.

    Return the exit code: 130 after an interrupt, else 0.
    """
    # More threads do not help small networks.
    threads = trainer.config.threads if reads_pictures(trainer.controller.learner.network) else 1
    with torch_threads(threads), folder.lock, lasting_output(), closing(trainer.turns.world):
        console = Console(quiet=is_quiet())

        def say(line: str) -> None:
            console.print(line, soft_wrap=True, markup=False)

        env, world = trainer.config.env, trainer.turns.world
        names = env.names if env.task is None else [f"{world.variants[0]}{' without goals' * (not world.goals)}"]
        speed = speed_in_words(trainer.config, trainer.steps)
        say(f"{trainer.config.title_on(names)}, into {folder.path}{speed}")
        if predicted := prediction_of(folder.path):
            say(f"predicted: {predicted.in_words()}")
        for line in (*world.stage_titles, *world.notes):
            say(line)
        meta = trainer.agents[META]
        if isinstance(meta, ScriptedAgent) and (unsaved := unsaved_memory(meta.meta)):
            name = trainer.config.resolved_method.meta
            say(
                f"warning: the meta-controller {name} has {unsaved}, but not both state_dict and load_state_dict: what "
                "it remembers is not saved, so resuming, evaluating and watching begin without it"
            )

        def say_how_to_go_on(how: str) -> None:
            logged = () if tuple(log) == DEFAULT else ("--log", ",".join(log) or NONE)
            again = "--resume", folder.path, *trust_option(trainer.config), *logged
            say(f"{how}; go on with:")
            say(shell_words("python", "-m", "hierroom", "train", *again))

        try:
            with Interrupt(say=say) as interrupt, _progress_bar(trainer, console) as report:
                is_stopped = train(trainer, folder, interrupt, report, log, callback)
            if trainer.is_done:
                write_results(trainer, folder, console)
        except (KeyboardInterrupt, InputError, RunError):
            say_how_to_go_on(f"stopped; the checkpoint after {folder.saved_steps:,} steps is kept")
            raise
        if trainer.is_done:
            return 0
        say_how_to_go_on(f"stopped {'by the callback ' * is_stopped}and saved")
        return 0 if is_stopped else 130


def train(
    trainer: Trainer,
    folder: RunFolder,
    interrupt: Interrupt,
    report: Callable[[str], object],
    log: Sequence[str] = DEFAULT,
    callback: Callback | None = None,
) -> bool:
    """Train until the end, an interrupt, a `DivergenceError`, or the callback stops it; return whether that did.

    Write tables, events for loggers, and checkpoints. A checkpoint is written last, so that a run resumed from it never
    repeats rows. Only the steps decide when to write or evaluate, so that a resumed run does the same. ``report`` gets
    a short status before each evaluation and after each update. If the callback raises an error, the run is saved.
    """
    logs = Logs(folder.path, trainer.config, trainer.steps or -1, log)  # -1: a new run has logged nothing yet
    total, evaluated = trainer.config.steps, ""
    points = evaluation_points(total, trainer.config.evaluations)

    def evaluate() -> str:
        curve, left = LearningCurve.of_rows(folder.evaluations.read()), 1 + sum(one > trainer.steps for one in points)
        used = 0.0 if curve is None else float(curve.episodes @ curve.length)
        is_known = trainer.log.episodes >= trainer.config.num_envs  # the first episodes to end are short ones
        length = trainer.log.means["episode_length"] if is_known else math.nan
        episodes = episodes_now(trainer.config, used, left, length)
        if episodes == 0:
            return evaluated
        report("evaluating,")
        with awaited("this evaluation"):
            evaluation = trainer.evaluation = trainer.evaluate(episodes)
        folder.evaluations.append(evaluation_rows(trainer.steps, trainer.seconds, evaluation))
        logs.add(evaluation_scalars(evaluation), trainer.steps)
        words = outcome_in_words(evaluation.success_rate, evaluation.mean_return, evaluation.score)
        return f" (evaluated {words[1]})"

    def has_completed_part(n_parts: int, before: int) -> bool:
        return before * n_parts // total < trainer.steps * n_parts // total

    try:
        if trainer.steps == 0 and points:
            evaluated = evaluate()
        is_last, is_stopped = trainer.is_done, False
        while not is_last:
            before = trainer.steps
            try:
                with awaited("this update"):
                    trainer.advance()
            except DivergenceError as error:
                raise DivergenceError(f"{error}. {_restart_advice(folder)}") from error
            is_last = trainer.is_done or interrupt.is_requested
            row = trainer.metrics()
            report(_status(trainer, row, evaluated))
            folder.episodes.append(trainer.log.ended)
            if before == 0 or has_completed_part(ROWS, before):
                folder.metrics.append([row])
                logs.add(metric_scalars(row), trainer.steps)
            if any(before < point <= trainer.steps for point in points):
                evaluated = evaluate()
                report(_status(trainer, row, evaluated))
            if trainer.is_done:
                logs.add_results(LearningCurve.of_rows(folder.evaluations.read()))
            stops = callback is not None  # if it raises
            try:
                if callback is not None:
                    with chdir("."):  # it may change the working folder, and the run's path may be relative
                        stops = bool(callback(trainer))
            finally:
                is_stopped, is_last = stops and not is_last, is_last or stops
                if has_completed_part(CHECKPOINTS, before):
                    folder.save_checkpoint(trainer.state_dict())
                elif is_last:
                    folder.save_checkpoint(trainer.state_dict(), is_interrupted=True)
        return is_stopped
    finally:
        logs.close(is_done=trainer.is_done)


def _status(trainer: Trainer, row: Mapping[str, float], evaluated: str) -> str:
    stages = trainer.turns.world.stage_titles
    stage = f"stage {row['stage']:.0f} of {len(stages)}, " if stages else ""
    is_long = stage or not row["episodes"]  # the line fits into 80 columns, and no length is shown before there is one
    length = "" if is_long else f" length {row['episode_length']:.0f},"
    outcome = " ".join(outcome_in_words(row["success_rate"], row["episode_return"], row.get("score", math.nan)))
    return f"{trainer.steps_per_second:,.0f} steps/s, {stage}{outcome}{evaluated},{length}"


@contextmanager
def _progress_bar(trainer: Trainer, console: Console) -> Iterator[Callable[[str], None]]:
    total = trainer.config.steps
    columns = (
        TextColumn("{task.percentage:3.0f}%"),
        BarColumn(),
        TextColumn("{task.fields[status]}"),
        TimeRemainingColumn(compact=True),
        TextColumn("left"),
    )
    with Progress(*columns, console=console, disable=console.quiet) as bar:
        task = bar.add_task("", total=total, completed=min(trainer.steps, total), status="begins,")
        yield lambda status: bar.update(task, completed=min(trainer.steps, total), status=status)


def _restart_advice(folder: RunFolder) -> str:
    """Return advice on a run that has diverged; resuming it unchanged would diverge again."""
    steps, path = folder.load_checkpoint()["steps"], folder.path
    warm_start = ("--warm-start", path) if steps else ()
    again = shell_words("--config", path / "config.json", *warm_start, *trust_option(folder.config()))
    return f"The checkpoint after {steps:,} steps is kept; begin again with {again} and what is to change"


def _try_out(trainer: Trainer) -> None:
    """Take a step in new environments, then save and load the state: user code should fail before a folder is made."""
    seed = derived_seed(trainer.config.seed, "evaluation")
    turns = trainer.fresh_turns(1, seed)
    trainer.freeze(1, seed=seed).step(turns)
    turns.world.close()
    try:
        trainer.load_state_dict(checkpoint.from_bytes(checkpoint.to_bytes(trainer.state_dict())))
    except InputError as error:
        raise InputError(f"what this run would save could not be loaded again: {error}") from error


def _record(folder: RunFolder, trainer: Trainer, variant: str) -> None:
    weights = trainer.controller.weights["learner"]["backend"]["network"]
    warm_start = digest({}, weights) if trainer.config.warm_start and trainer.steps == 0 else ""
    for line in record_session(folder.path, trainer.config, variant, warm_start):
        warn(line)
