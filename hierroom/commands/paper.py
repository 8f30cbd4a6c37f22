"""The paper's tables and figures: ``python -m hierroom paper table3``."""

from __future__ import annotations

import sys

import tyro

from hierroom.support.cli import one_line_usage, program, run, words


def main() -> int:
    """The command."""
    from hierroom.lab.paper.table2 import Table2

    commands: dict[str, type] = {"table2": Table2}
    if sys.argv[1:2] != ["table2"]:  # which trains nothing, and need not wait for what trains
        from hierroom.lab.paper.figures import All, Figure3, Figure4, Figure5
        from hierroom.lab.paper.table3 import Table3

        commands |= {"table3": Table3, "figure3": Figure3, "figure4": Figure4, "figure5": Figure5, "all": All}
    description = "The paper's tables and figures, ours beside its own numbers."
    argv = words()
    with one_line_usage(argv):
        part = tyro.extras.subcommand_cli_from_dict(commands, prog=program("paper"), description=description, args=argv)
    part.run()
    return 0


def script() -> None:
    """The command, as ``hierroom-paper``."""
    run(main)


if __name__ == "__main__":
    script()
