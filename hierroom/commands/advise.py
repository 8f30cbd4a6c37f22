"""Command line: which method, how many steps and how sure, before anybody trains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hierroom.support.cli import Flag, given, read_arguments
from hierroom.support.errors import InputError
from hierroom.support.files import to_json


@dataclass(frozen=True)
class AdviseArguments:
    """Say before training what to expect: which method, how many steps, and how sure, by random play and the rules.

    Args:
        graph: a goal graph of EscapeRooms, given as in training.
        task: a task instead: package.module:name of a hierroom.Task, or a built-in world such as workshop:6.
        rules: a TOML file of rules instead; without play only the chain is measured.
        max_steps: steps after which an episode is truncated; by default as in training.
        size: cells of the grid's side, of EscapeRooms.
        drop: let the controller drop keys.
        seconds: time to play; Ctrl-C ends play earlier, and shows what is known.
        play_steps: primitive steps to play in place of seconds, so that equal seeds give equal answers.
        seed: seed of the levels and the actions.
        write: write the rules as play repairs them into this .toml file, which must not exist.
        json: print everything as JSON.
        check: print spaces, networks and speeds instead, and try whether episodes and a resumed run repeat.
    """

    graph: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[GRAPH]")] = None
    task: str | None = None
    rules: Path | None = None
    max_steps: int | None = None
    size: int | None = None
    drop: Flag = False
    seconds: float = 30.0
    play_steps: int | None = None
    seed: int = 0
    write: Path | None = None
    json: Flag = False
    check: Flag = False


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(AdviseArguments, "advise", argv)
    if (path := arguments.write) is not None:
        if path.suffix != ".toml" or not path.parent.is_dir():
            raise InputError(f"rules are written to a .toml file in a folder that is there, not to {path}")
        if path.exists():
            raise InputError(f"{path} is there already; name another file, or delete it")
    from hierroom.lab.advise.advise import advise  # imports the world and the learners
    from hierroom.lab.advise.rule_check import complete

    entries = given(arguments, "graph", "task", "rules", "max_steps", "size", "play_steps")
    entries |= {"drop_key": True} if arguments.drop else {}
    if arguments.check:
        from hierroom.lab.advise.check import check
        from hierroom.runs.config.presets import start_config

        if path is not None or "rules" in entries or "play_steps" in entries:
            raise InputError("--check trains in a graph or a task; leave out --rules, --write and --play-steps")
        checked = check(start_config(None, entries).changed(**entries))
        print(to_json(checked) if arguments.json else "\n".join(f"{name:<16} {text}" for name, text in checked.items()))
        return 0
    advice = advise(seconds=arguments.seconds, seed=arguments.seed, **entries)
    print(to_json(advice.to_dict()) if arguments.json else advice)
    if advice.costs is not None:
        advice.save()
    if path is not None:
        if advice.rules is None:
            raise InputError("there are no rules to repair: those of goal graphs hold, as levels are built from them")
        complete(advice.rules).to_toml(path)
    return 0
