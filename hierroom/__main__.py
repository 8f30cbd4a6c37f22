"""The command line: ``python -m hierroom COMMAND``, or ``hierroom COMMAND`` if the script is on the path."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from types import ModuleType

import tyro

import hierroom
from hierroom.support.cli import run
from hierroom.support.errors import InputError

COMMANDS: Mapping[str, str] = {
    "train": "train an agent and write a run folder",
    "sweep": "train many runs, on every core or many machines, into one table",
    "play": "play a level yourself, with hints, and a trained agent that can take over",
    "watch": "watch a trained agent, its failures too: in a window, as GIF or text",
    "evaluate": "success, length and steps to each goal of a trained agent",
    "compare": "learning curves of several runs, with intervals, as tables and a figure",
    "report": "one HTML page on runs: curves, goals, complexity against learning, replay of episodes",
    "advise": "which method, how many steps and how sure, before anybody trains",
    "complexity": "how hard goal graphs are to explore, before anybody trains",
    "compile": "compile all kernels now, so that nothing waits for it later",
}


def main(argv: Sequence[str]) -> int:
    """Run the command that the first word names, or list all commands."""
    match argv:
        case [] | ["-h" | "--help", *_]:
            _print_commands()
        case ["--version", *_]:
            print(hierroom.__version__)
        case [*_, "--tyro-print-completion", "bash" | "zsh" | "fish"]:
            # Write one completion script for all commands, as shells look it up by the program's name alone.
            kinds = {name: getattr(_module(name), f"{name.capitalize()}Arguments") for name in COMMANDS}
            tyro.extras.subcommand_cli_from_dict(kinds, prog="hierroom", args=argv[-2:])
        case [name, *words] if name in COMMANDS:
            return _module(name).main(words)
        case [name, *_]:
            near = get_close_matches(name, COMMANDS)
            hint = f"did you mean {' or '.join(near)}? " if near else ""
            raise InputError(f"there is no command {name!r}; {hint}python -m hierroom lists all")
    return 0


def _module(name: str) -> ModuleType:
    return import_module("hierroom.train" if name == "train" else f"hierroom.commands.{name}")


def _print_commands() -> None:
    print(f"hierroom {hierroom.__version__}: {(hierroom.__doc__ or '').splitlines()[0]}\n")
    for name, purpose in COMMANDS.items():
        print(f"  python -m hierroom {name:<11} {purpose}")
    completion = 'eval "$(hierroom --tyro-print-completion bash)" (or zsh, fish)'
    print("\nEach explains itself with --help; hierroom COMMAND is short for python -m hierroom COMMAND.")
    print(f"A shell completes commands and options after {completion}.")


def script() -> None:
    """Run the command line of this process."""
    run(lambda: main(sys.argv[1:]))


if __name__ == "__main__":
    script()
