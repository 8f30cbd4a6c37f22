"""Train an agent: ``python -m hierroom train``, or ``python -m hierroom.train``, or from Python `train`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.config_file import read_config
from hierroom.runs.config.presets import find_preset, implied_preset
from hierroom.support.cli import read_arguments, run
from hierroom.support.errors import InputError

if TYPE_CHECKING:
    from hierroom.runs.trained_agent import TrainedAgent

_CODE = ("meta", "network", "reward")
"""Options that may name code of the user's own."""
_ONLY_BESIDE_RESUME = "a resumed run keeps its config; only --steps, --threads and --device may be given"


@dataclass(frozen=True)
class TrainArguments:
    """Train an agent in EscapeRooms and write a run folder.

    Args:
        config_file: a TOML file of options named as here, with underscores (num_envs = 32), or the config.json of a run
            to repeat; what the command line names counts more.
        out: the run folder, new; by default runs/ and a name that shows what differs from the preset.
        resume: a run folder to go on with; only --steps, --threads and --device may be given beside it.
        trust_run: run the code that the config.json of --config or --resume names beside what ships with hierroom, and
            that is not named here by --meta, --network or --reward.
        log: where the run is shown while it trains, joined by commas: tensorboard, wandb and mlflow, of which the last
            two are to be installed; none for nowhere. A run that is resumed goes on there if it is named again.
    """

    config: Annotated[TrainConfig, tyro.conf.arg(name="")]
    config_file: Annotated[Path | None, tyro.conf.arg(name="config")] = None
    out: Path | None = None
    resume: Path | None = None
    trust_run: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    log: str = "tensorboard"


def parse(argv: Sequence[str]) -> TrainArguments:
    """Read the command line; options that it does not name come from a file, the preset or the resumed run."""
    first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for name in ("preset", *_CODE, "config", "resume", "out"):
        first.add_argument(f"--{name}", nargs="?")  # tyro says later that a value is missing
    known, _ = first.parse_known_args(argv)
    trust = "--trust-run" in argv or "--trust_run" in argv
    if known.resume and not (known.preset is known.config is known.out is None):
        raise InputError(_ONLY_BESIDE_RESUME)
    named = {name: getattr(known, name) for name in ("preset", *_CODE) if getattr(known, name) is not None}
    if known.resume:
        default = _config_of(known.resume, trust, named)
    elif known.config:
        default = read_config(known.config, trust=trust, **named)
    else:
        default = find_preset(known.preset or implied_preset(known.meta))
    arguments = read_arguments(TrainArguments, "train", argv, TrainArguments(config=default))
    config = arguments.config
    kept = config.changed(steps=default.steps, threads=default.threads, device=default.device)
    if known.resume and kept != default:
        raise InputError(_ONLY_BESIDE_RESUME)
    return arguments


def train(
    config: TrainConfig | None = None, *, out: str | Path | None = None, log: str = "tensorboard", **entries: Any
) -> TrainedAgent:
    """Train an agent as the command does, with a progress bar and a run folder.

    Ctrl-C saves, and then raises KeyboardInterrupt; the command line goes on with ``--resume``.

    Args:
        config: what to train, such as `hierroom.find_preset` gives. None: the ``preset`` among the
            entries, else ``default``, or ``learned`` where ``meta="learned"``.
        out: the run folder, new or empty; None: a new one in ``runs/`` whose name shows what differs from the preset.
        log: where the run is shown while it trains: ``"tensorboard"``, ``"wandb"``, ``"mlflow"``, several joined by
            commas, or ``"none"``.
        **entries: entries of the config that are to be others, named as on the command line but with underscores:
            ``graph="f"``, ``steps=2_000_000``, ``method="ppo"``.

    Returns:
        the trained agent, as `hierroom.load` gives it.

    Raises:
        KeyboardInterrupt: if it was interrupted.
    """
    import torch

    from hierroom.runs.logs.logs import logger_names
    from hierroom.runs.session import begin, run_session
    from hierroom.runs.trained_agent import load

    start = config
    if not isinstance(start, TrainConfig | None):
        raise InputError(f"train takes a TrainConfig and entries such as graph='c', not {start!r}")
    if start is None:
        start = find_preset(entries.pop("preset", None) or implied_preset(entries.get("meta")))
    loggers, config = logger_names(log), start.changed(**entries)
    trainer, folder = begin(config, None if out is None else Path(out))
    _warn_of_what_does_nothing(config)
    n_threads = torch.get_num_threads()
    try:
        if run_session(trainer, folder, loggers):
            raise KeyboardInterrupt
    finally:
        torch.set_num_threads(n_threads)  # a session sets it for the whole process
    return load(folder.path, trust=True)  # what it names was named in this call


def main(argv: Sequence[str]) -> int:
    """Run the command on its words."""
    arguments = parse(argv)
    from hierroom.runs.logs.logs import logger_names
    from hierroom.runs.session import begin, resume, run_session  # torch takes its time, and --help needs none

    loggers = logger_names(arguments.log)
    if arguments.resume:
        return run_session(*resume(arguments.config, arguments.resume), loggers)
    trainer, folder = begin(arguments.config, arguments.out)
    _warn_of_what_does_nothing(arguments.config)
    if arguments.config_file is not None and arguments.config_file.name == "config.json":
        from hierroom.runs.folder.provenance import warn_of_changed_modules

        warn_of_changed_modules(arguments.config_file.parent, arguments.config)
    return run_session(trainer, folder, loggers)


def _warn_of_what_does_nothing(config: TrainConfig) -> None:
    """Graphs that another one stands for, and entries that the method does not read."""
    from hierroom.complexity.graph_set import find_graphs
    from hierroom.runs.config.unread_entries import unread_note
    from hierroom.runs.logs.output import warn

    unread = unread_note(config)
    for note in [
        *find_graphs(config.env.graph, config.env.exclude, config.env.drop_key).notes,
        *([unread] if unread else []),
    ]:
        warn(note)


def _config_of(path: str, trust: bool, named: Mapping[str, str]) -> TrainConfig:
    from hierroom.runs.folder.run_folder import RunFolder  # it brings torch along
    from hierroom.runs.folder.trust import require_trust

    config = RunFolder.open(path).config()
    require_trust(Path(path), config, trust=trust, named=named)
    return config


if __name__ == "__main__":
    run(lambda: main(sys.argv[1:]))
