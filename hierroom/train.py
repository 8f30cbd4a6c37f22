"""Train an agent: ``python -m hierroom.train --meta fixed-dfs``, or from Python `train`."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.cli import program, run
from hierroom.errors import InputError
from hierroom.training.config import TrainConfig
from hierroom.training.presets import PRESETS, PresetName, find_preset

if TYPE_CHECKING:
    from hierroom.training.trained_agent import TrainedAgent

_ONLY_BESIDE_RESUME = "a resumed run keeps its config; only --steps, --threads and --device may be given"


@dataclass(frozen=True)
class TrainArguments:
    """Train an agent in EscapeRooms and write a run folder.

    Args:
        preset: what the other options start from: default, long (for five million steps and the shortest ways),
            large (for grids of 31 cells and more), learned (for --meta learned, which implies it) or paper (section 3
            of the paper).
        out: the run folder, new; by default runs/ and the run's name.
        resume: a run folder to go on with; only --steps, --threads and --device may be given beside it.
    """

    config: Annotated[TrainConfig, tyro.conf.arg(name="")]
    preset: PresetName | None = None
    out: Path | None = None
    resume: Path | None = None


def parse(argv: list[str] | None = None) -> TrainArguments:
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
    if known.resume and (known.preset is not None or known.out is not None):
        raise InputError(_ONLY_BESIDE_RESUME)
    default = _config_of(known.resume) if known.resume else _preset_for(known.preset, known.meta)
    start = TrainArguments(config=default)
    arguments = tyro.cli(TrainArguments, prog=program("train"), default=start, args=argv)
    config = arguments.config
    kept = config.changed(steps=default.steps, threads=default.threads, device=default.device)
    if known.resume and kept != default:
        raise InputError(_ONLY_BESIDE_RESUME)
    return arguments


def train(config: TrainConfig | None = None, *, out: str | Path | None = None, **entries: Any) -> TrainedAgent:
    """Train an agent as the command does, with a progress bar and a run folder.

    Ctrl-C saves, and then raises KeyboardInterrupt; the command line goes on with ``--resume``.

    Args:
        config: what to train, such as `hierroom.find_preset` gives. None: the preset ``default``, or ``learned`` where
            ``meta="learned"``.
        out: the run folder, new or empty; None: a folder in ``runs/`` with the name of the config.
        **entries: entries of the config that are to be others, named as on the command line but with underscores:
            ``graph="f"``, ``steps=2_000_000``, ``method="ppo"``.

    Returns:
        the trained agent, as `hierroom.load` gives it.

    Raises:
        InputError: if an entry is unknown or cannot be used, or the folder cannot be created.
        KeyboardInterrupt: if it was interrupted.
    """
    import torch

    from hierroom.training.session import begin, run_session
    from hierroom.training.trained_agent import load

    start = _preset_for(None, entries.get("meta")) if config is None else config
    trainer, folder = begin(start.changed(**entries), None if out is None else Path(out))
    n_threads = torch.get_num_threads()
    try:
        if run_session(trainer, folder):
            raise KeyboardInterrupt
    finally:
        torch.set_num_threads(n_threads)  # a session sets it for the whole process
    return load(folder.path)


def main(argv: list[str] | None = None) -> int:
    """The command."""
    arguments = parse(argv)
    from hierroom.training.session import begin, resume, run_session  # torch takes its time, and --help needs none

    if arguments.resume:
        return run_session(*resume(arguments.config, arguments.resume))
    return run_session(*begin(arguments.config, arguments.out))


def _preset_for(preset: str | None, meta: object) -> TrainConfig:
    """The preset that is named; a meta-controller that needs other settings than the default has one of its own name.

    Raises:
        InputError: if there is no such preset.
    """
    return find_preset(preset or (meta if isinstance(meta, str) and meta in PRESETS else "default"))


def _config_of(path: str) -> TrainConfig:
    from hierroom.training.run_folder import RunFolder  # it brings torch along

    return RunFolder.open(path).config()


def script() -> None:
    """The command, as ``hierroom-train``."""
    run(main)


if __name__ == "__main__":
    script()
