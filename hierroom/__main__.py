"""List the commands: ``python -m hierroom``."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

import hierroom
from hierroom.support.cli import COMMANDS, one_line_usage, run


@dataclass(frozen=True)
class ListArguments:
    """EscapeRoom environments, exploration complexity and hierarchical PPO: the commands.

    Args:
        version: print the version.
    """

    version: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def main() -> int:
    """The command."""
    if sys.argv[1:2] and sys.argv[1] in COMMANDS:
        name = sys.argv.pop(1)
        home = "hierroom.train" if name == "train" else f"hierroom.commands.{name}"
        return importlib.import_module(home).main()
    with one_line_usage():
        called = "hierroom" if Path(sys.argv[0]).stem == "hierroom" else "python -m hierroom"
        arguments = tyro.cli(ListArguments, prog=called)
    if arguments.version:
        print(hierroom.__version__)
        return 0
    print(f"hierroom {hierroom.__version__}: {ListArguments.__doc__.splitlines()[0]}\n")  # pyright: ignore[reportOptionalMemberAccess]
    for name, purpose in COMMANDS.items():
        print(f"  python -m hierroom {name:<11} {purpose}")
    print("\nEach explains itself with --help, and is also there as hierroom-train, hierroom-evaluate and so on, whose")
    print('options a shell completes after, for instance, eval "$(hierroom-train --tyro-print-completion bash)".')
    return 0


def script() -> None:
    """The command, as ``hierroom``."""
    run(main)


if __name__ == "__main__":
    script()
