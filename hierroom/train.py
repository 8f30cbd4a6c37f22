"""Train an agent: ``python -m hierroom train``, or ``python -m hierroom.train``, or from Python `train`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import tyro

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import start_config
from hierroom.runs.folder.config_file import read_config
from hierroom.support.cli import Flag, read_arguments, run
from hierroom.support.errors import InputError, shown
from hierroom.worlds.env_config import OF_ESCAPE_ROOMS, is_task
from hierroom.worlds.make import WorldMaker, name_in_module

if TYPE_CHECKING:
    from hierroom.runs.trained_agent import TrainedAgent
    from hierroom.runs.trainer import Trainer

_CODE = ("meta", "network", "reward", "task")  # options that may name custom code
_LEVELS = ("graph", "layout")
_WITH_RESUME = "a resumed run keeps its config; only --steps, --threads and --device may be given"


@dataclass(frozen=True)
class TrainArguments:
    """Train an agent in EscapeRooms or in a task and write a run folder.

    Args:
        config_file: a TOML file of options named as here, with underscores (num_envs = 32), or the config.json of a run
            to repeat; options on the command line override it.
        out: the run folder, new; by default, one in runs/ named after the differences from the preset.
        resume: a run folder to continue; it allows only --steps, --threads and --device.
        trust_run: run custom code that the config.json of --config or --resume names, but this command line does not.
        log: where to show the run while it trains: tensorboard, wandb (install it), both joined by a comma, or none.
            Give this option again for a resumed run.
    """

    config: Annotated[TrainConfig, tyro.conf.arg(name="")]
    config_file: Annotated[Path | None, tyro.conf.arg(name="config")] = None
    out: Path | None = None
    resume: Path | None = None
    trust_run: Flag = False
    log: str = "tensorboard"


def parse(argv: Sequence[str]) -> TrainArguments:
    """Read the command line; other options come from a file, the preset or the resumed run."""
    first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for name in ("preset", "method", *_CODE):
        first.add_argument(f"--{name}", nargs="?")  # tyro reports a missing value later
    for name in ("config", "resume", "out"):
        first.add_argument(f"--{name}", nargs="?", type=Path)  # "", as of an unset variable, becomes the current folder
    for name in OF_ESCAPE_ROOMS:
        first.add_argument(f"--{name}", f"--{name.replace('_', '-')}", nargs="*")
    known, _ = first.parse_known_args(argv)
    trust = "--trust-run" in argv or "--trust_run" in argv
    if known.resume and not (known.preset is known.config is known.out is None):
        raise InputError(_WITH_RESUME)
    words = {name: word for name in ("preset", "method", *_CODE) if (word := getattr(known, name)) is not None}
    named = {name: None if word == "None" and name in _CODE else word for name, word in words.items()}
    if known.resume:
        from hierroom.runs.folder.run_folder import RunFolder  # imports torch
        from hierroom.runs.folder.user_code import require_trust

        default = RunFolder.open(known.resume).config()
        require_trust(known.resume, default, trust=trust, named=named)
    elif known.config:
        default = read_config(known.config, trust=trust, **named)
    else:
        default = start_config(known.preset, named).changed(task=named.get("task"))
    if known.graph and known.layout:
        raise InputError("--graph and --layout are both given; a layout has a goal graph of its own, so leave one out")
    for name in () if known.resume else _LEVELS:  # each replaces the other in the preset or file
        if words := getattr(known, name):
            default = default.changed(**{name: words})
    arguments = read_arguments(TrainArguments, "train", argv, TrainArguments(config=default))
    given = [name for name in OF_ESCAPE_ROOMS if getattr(known, name) is not None]
    arguments.config.env.refuse_unread(given)
    kept = arguments.config.changed(steps=default.steps, threads=default.threads, device=default.device)
    if known.resume and kept != default:
        raise InputError(_WITH_RESUME)
    return arguments


def train(
    config: TrainConfig | None = None,
    *,
    out: str | Path | None = None,
    log: str = "tensorboard",
    callback: Callable[[Trainer], object] | None = None,
    quiet: bool = False,
    **entries: Any,
) -> TrainedAgent:
    """Train an agent, with a progress bar and a run folder; return it as `hierroom.load` does.

    Ctrl-C saves the run and raises KeyboardInterrupt; continue on the command line with ``--resume``.

    Args:
        config: a config, such as from `hierroom.find_preset`. None: the ``preset`` among the entries; without one,
            ``learned`` for ``meta="learned"`` in EscapeRooms, else ``default``.
        out: the run folder, new or empty; None: a new one in ``runs/``, named after the differences from the preset.
        log: ``"tensorboard"``, ``"wandb"``, both joined by a comma, or ``"none"``.
        callback: called with the `Trainer` after each update. If it returns a true value, the run is saved and stops,
            as after Ctrl-C; ``--resume`` continues it. Its errors are raised here, after the run is saved.
        quiet: whether to print nothing: no progress, results or warnings of the run.
        **entries: changed entries of the config, named as on the command line but with underscores: ``graph="f"``,
            ``steps=2_000_000``, ``method="ppo"``. The ``task`` may be a `hierroom.Task` that a module holds.

    Examples:
        >>> tiny = dict(graph="a", size=11, max_steps=50, steps=256, num_envs=8, evaluations=0)
        >>> agent = hierroom.train(**tiny, out="run", quiet=True)
        >>> agent.is_finished, hierroom.load("run").steps
        (True, 256)
    """
    from hierroom.learners.networks.initial_weights import plain_torch  # slow to load, as is the session
    from hierroom.runs.logs.logs import logger_names
    from hierroom.runs.session import begin, run_session
    from hierroom.runs.trained_agent import load
    from hierroom.support.output import silence

    if callback is not None and not callable(callback):
        raise InputError(f"callback is a function of the trainer, not {shown(callback)}")
    if not isinstance(quiet, bool):
        raise InputError(f"quiet must be True or False, not {shown(quiet)}")
    if config is None:
        config = start_config(entries.pop("preset", None), entries)
    elif not isinstance(config, TrainConfig):
        raise InputError(f"train takes a TrainConfig and entries such as graph='c', not {config!r}")
    if is_task(task := entries.get("task")):
        entries["task"] = name_in_module(cast(WorldMaker, task))
    config = config.changed(**entries)
    with ExitStack() as stack:
        if quiet:
            stack.enter_context(silence())
        loggers = logger_names(log)
        stack.enter_context(plain_torch())
        trainer, folder = begin(config, None if out is None else Path(out))
        _warn_of_what_does_nothing(config)
        if run_session(trainer, folder, loggers, callback):
            raise KeyboardInterrupt
    return load(folder.path, trust=True)  # this call has named all code that it loads


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = parse(argv)
    from hierroom.runs.logs.logs import logger_names
    from hierroom.runs.session import begin, resume, run_session  # slow to load, and --help does not need it

    loggers = logger_names(arguments.log)
    if arguments.resume:
        return run_session(*resume(arguments.config, arguments.resume), loggers)
    if arguments.config_file is not None and arguments.config_file.name == "config.json":
        from hierroom.runs.folder.provenance import warn_of_changed_modules

        warn_of_changed_modules(arguments.config_file.parent, arguments.config)
    trainer, folder = begin(arguments.config, arguments.out)
    _warn_of_what_does_nothing(arguments.config)
    return run_session(trainer, folder, loggers)


def _warn_of_what_does_nothing(config: TrainConfig) -> None:
    """Warn of graphs that are equal to another one and left out, and of entries that the method does not use."""
    from hierroom.complexity.graph_set import find_graphs
    from hierroom.runs.config.unread_entries import unread_note
    from hierroom.support.output import warn

    env = config.env
    graphs = find_graphs(env.graph, env.exclude, env.drop_key).notes if env.kind == "graph" else ()
    for note in (*graphs, unread_note(config)):
        if note:
            warn(note)


if __name__ == "__main__":
    run(lambda: main(sys.argv[1:]))
