"""Train the agents that ship with hierroom, and write their weights: ``python -m benchmarks.weights``.

Each is the run of its preset with seed 0: ``a`` to ``g`` HiPPO of the default preset, ``learned-g`` a learned
meta-controller. The folder of the runs must be new, so that no older agent is shipped; ``--resume`` goes on with what
an interrupted call left there. The same machine and versions give the same weights.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.weights import FOLDER, SHIPPED, SUFFIX
from hierroom.runs.session import begin, resume, run_session


def config_of(name: str) -> TrainConfig:
    """Return the config of an agent that ships.

    Args:
        name: in `SHIPPED`.
    """
    preset = "learned" if name.startswith("learned") else "default"
    return hierroom.find_preset(preset).changed(graph=name[-1], threads=1, evaluation_episodes=100)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SHIPPED)}; all by default")
    parser.add_argument("--runs", type=Path, default=Path("runs/weights"), help="folder of the runs")
    parser.add_argument("--resume", action="store_true", help="go on with the runs that are there")
    arguments = parser.parse_args()
    names = arguments.names or [*SHIPPED]
    if unknown := {*names} - {*SHIPPED}:
        parser.error(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(SHIPPED)}")
    if arguments.runs.exists() and not arguments.resume:
        parser.error(f"{arguments.runs} is there already: --resume goes on with it, --runs names another folder")
    FOLDER.mkdir(exist_ok=True)
    for name in names:
        folder, config = arguments.runs / name, config_of(name)
        is_begun = (folder / "config.json").is_file()
        if run_session(*(resume(config, folder) if is_begun else begin(config, folder)), ()):
            return 130
        trained = hierroom.load(folder)
        trained.save(FOLDER / f"{name}{SUFFIX}")
        print(f"{name}: {trained.steps:,} steps, {(FOLDER / f'{name}{SUFFIX}').stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
