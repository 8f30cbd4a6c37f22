"""Train an agent: ``python -m hierroom.train --meta fixed-dfs``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hierroom.cli import program, run, words
from hierroom.errors import InputError
from hierroom.training.config import TrainConfig
from hierroom.training.presets import PRESETS, PresetName, find_preset

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
    argv = words(argv)
    first = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    for name in ("--preset", "--meta", "--resume", "--out"):
        first.add_argument(name)
    try:
        known, _ = first.parse_known_args(argv)
    except argparse.ArgumentError as error:
        raise InputError(str(error)) from error
    if known.resume and (known.preset is not None or known.out is not None):
        raise InputError(_ONLY_BESIDE_RESUME)
    # A meta-controller that needs other settings than the default has a preset of its own name.
    preset = known.preset or (known.meta if known.meta in PRESETS else "default")
    default = _config_of(known.resume) if known.resume else find_preset(preset)
    start = TrainArguments(config=default)
    arguments = tyro.cli(TrainArguments, prog=program("train"), default=start, args=argv)
    config = arguments.config
    kept = config.changed(steps=default.steps, threads=default.threads, device=default.device)
    if known.resume and kept != default:
        raise InputError(_ONLY_BESIDE_RESUME)
    return arguments


def main(argv: list[str] | None = None) -> int:
    """The command."""
    arguments = parse(argv)
    from hierroom.training.session import begin, resume, run_session  # torch takes its time, and --help needs none

    if arguments.resume:
        return run_session(*resume(arguments.config, arguments.resume))
    return run_session(*begin(arguments.config, arguments.out))


def _config_of(path: str) -> TrainConfig:
    from hierroom.training.run_folder import RunFolder  # it brings torch along

    return RunFolder.open(path).config()


def script() -> None:
    """The command, as ``hierroom-train``."""
    run(main)


if __name__ == "__main__":
    script()
