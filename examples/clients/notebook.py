"""Jupyter: how goal graphs and reports look in a notebook, asked as a notebook asks."""

from pathlib import Path

from IPython.core.formatters import DisplayFormatter

import hierroom

graph = hierroom.GoalGraph((0, 0, 1), exit_room=3)
formatter = DisplayFormatter()
formatter.active_types = list(formatter.format_types)
for what in (graph, hierroom.complexity.analyze(graph)):
    shown, _ = formatter.format(what)
    print(f"{type(what).__name__}: {', '.join(sorted(shown))}")
    if "image/svg+xml" in shown:
        Path("graph.svg").write_text(shown["image/svg+xml"], encoding="utf-8")
