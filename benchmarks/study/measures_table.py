"""Every measure of each goal graph of the study, computed before any training.

    python -m benchmarks.study.measures_table

A row a graph. What is there already is kept, if it was made with the same settings, so that an interrupted table goes
on where it stopped. `python -m benchmarks.study.statistics` holds it against what was trained.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import tyro

from benchmarks.measures.mdp import graph_mdp
from benchmarks.measures.played import measure_play
from benchmarks.measures.summary import measure_mdp, measure_walk
from benchmarks.study.graphs import study_graphs, twins
from benchmarks.study.tables import MEASURES_PATH, Row, read_measures
from hierroom.agents.player import make_player
from hierroom.complexity import analyze
from hierroom.goals import GoalGraph
from hierroom.support.cli import progress_bar, run
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig


@dataclass(frozen=True)
class Settings:
    """Everything besides its graph that the numbers of a row depend on.

    Args:
        horizon: steps of an episode on the goal graph's MDP.
        size: cells of the grid's side in random play.
        episodes: episodes of random play of the usual length, for the rate of success.
        max_steps: steps after which such an episode is truncated.
        chain_episodes: long episodes of random play, from which the chain is measured.
        chain_steps: steps after which a long episode is truncated.
        seed: of levels and actions.
    """

    horizon: int = 20
    size: int = 19
    episodes: int = 2000
    max_steps: int = 1000
    chain_episodes: int = 200
    chain_steps: int = 20_000
    seed: int = 0


@dataclass(frozen=True)
class Options:
    """Measure the goal graphs of the study.

    Args:
        settings: how they are measured.
        sampled: graphs of six rooms, and of seven, that are sampled.
        graphs_seed: of the sample, and of the twins' numbers.
        out: the table.
    """

    settings: Settings = field(default_factory=Settings)
    sampled: int = 20
    graphs_seed: int = 0
    out: Path = MEASURES_PATH


def measured_row(graph: GoalGraph, settings: Settings, twin_of: str = "") -> dict[str, Any]:
    """Every measure of a goal graph.

    Args:
        graph: the graph.
        settings: how it is measured.
        twin_of: the name of the same graph with other numbers of rooms, if it is a copy.
    """
    report = analyze(graph)
    mdp = measure_mdp(graph_mdp(report.augmented), settings.horizon)
    return {
        "graph": graph.name,
        "twin_of": twin_of,
        "key_rooms": "-".join(map(str, graph.key_rooms)),
        "exit_room": graph.exit_room,
        "rooms": graph.n_rooms,
        "goals": graph.n_goals,
        "exit_depth": graph.exit_depth,
        "width": graph.width,
        "hitting_time": report.hitting_time,
        "expected_steps": report.expected_steps,
        **asdict(mdp),
        **asdict(measure_walk(report.chain)),
        **_of_play(graph, settings),
        "settings": settings_text(settings),
    }


def settings_text(settings: Settings) -> str:
    """Return the settings as the text by which a row of others is recognised."""
    return " ".join(f"{name}={value}" for name, value in asdict(settings).items())


def make_table(graphs: Mapping[str, tuple[GoalGraph, str]], settings: Settings, path: Path) -> list[Row]:
    """Measure the graphs that the table at a path lacks, writing it after each.

    Args:
        graphs: each graph by name, and the name of its twin, or nothing.
        settings: how they are measured.
        path: the table; its folder is made.

    Returns:
        Their rows, in the order of the graphs. The table holds rows of other graphs with the same settings after them.

    Raises:
        InputError: if the file cannot be read or written, or is no such table.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = {row["graph"]: row for row in read_measures(path) if row["settings"] == settings_text(settings)}
    missing = [name for name in graphs if name not in rows]
    with progress_bar() as bar:
        for name in bar.track(missing, description="measuring"):
            graph, twin_of = graphs[name]
            rows[name] = {column: str(value) for column, value in measured_row(graph, settings, twin_of).items()}
            others = [row for name, row in rows.items() if name not in graphs]
            write_atomically(path, csv_text([*(rows[one] for one in graphs if one in rows), *others]))
    return [rows[name] for name in graphs]


def _of_play(graph: GoalGraph, settings: Settings) -> dict[str, float]:
    """Return the random policy's success in real levels, and the chain measured from its play.

    In episodes of the usual length random play reaches few nodes beyond the first, so the chain is that of longer ones.
    """

    def play(episodes: int, max_steps: int):
        config = EnvConfig(graph=graph, size=settings.size, max_steps=max_steps, levels="evaluation")
        turns = Turns(config, min(100, episodes), seed=settings.seed)
        return measure_play(turns, make_player("random", settings.seed), episodes)

    usual, long = play(settings.episodes, settings.max_steps), play(settings.chain_episodes, settings.chain_steps)
    return {
        "play_success": usual.success_rate,
        "play_hitting_time": long.chain.hitting_time,
        "play_expected_steps": long.chain.expected_steps,
        "play_long_success": long.success_rate,
    }


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__, config=(tyro.conf.OmitArgPrefixes,))
    graphs = {graph.name: (graph, "") for graph in study_graphs(options.sampled, options.graphs_seed)}
    graphs |= {twin.name: (twin, name) for name, twin in twins(options.graphs_seed).items()}
    rows = make_table(graphs, options.settings, options.out)
    print(f"{len(rows)} goal graphs with {len(rows[0])} columns are in {options.out}")
    return 0


if __name__ == "__main__":
    run(main)
