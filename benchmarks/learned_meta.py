"""The learned meta-controller, from scratch, beside a random one on the same controller: one row a run.

    python benchmarks/learned_meta.py --goal-masks existing --steps 2_000_000 --episodes 500 --out learned.csv

Each run trains controller and meta-controller together and is then evaluated apart from training, its actions sampled:
once as it is, once with goals drawn at random from the same mask in place of those it learned to choose. Rows that the
file already holds are not run again, so a table that was stopped goes on where it was.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median

import tyro
from run_table import fill, in_millions, read, train

from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.cli import run
from hierroom.meta import RandomGoals
from hierroom.training.assembly import freeze
from hierroom.training.config import TrainConfig
from hierroom.training.evaluation import evaluate
from hierroom.training.presets import find_preset


@dataclass(frozen=True)
class Options:
    """Train and evaluate a table of runs."""

    out: Path
    """The CSV file, made or gone on with."""
    graphs: tuple[str, ...] = ("a", "b", "c", "d", "e", "f", "g")
    """Goal graphs to train on."""
    goal_masks: tuple[str, ...] = ("existing", "seen", "none")
    """Which goals may be chosen: reachable, existing, seen or none (all of them)."""
    seeds: int = 3
    """Seeds 0, 1, ... of each."""
    steps: int = 3_000_000
    """Primitive steps of each run."""
    episodes: int = 1000
    """Episodes of each evaluation."""
    processes: int = os.cpu_count() or 1
    """Runs at a time."""


def train_and_evaluate(config: TrainConfig, episodes: int) -> dict[str, object]:
    """The numbers of one run."""
    trainer, summary = train(config)
    row: dict[str, object] = {name: summary[name] for name in ("steps_to_50", "steps_to_90", "steps_to_95", "seconds")}
    num_envs = min(100, episodes)
    learned = trainer.freeze(num_envs, seed=config.seed)
    other = freeze(ScriptedAgent(RandomGoals()), trainer.controller, num_envs, seed=config.seed)
    for name, pair in (("learned", learned), ("random", other)):
        turns = trainer.fresh_turns(num_envs, config.seed)
        result = evaluate(pair, turns, episodes)
        row[f"{name}_success"], row[f"{name}_length"] = result.success_rate, result.length
        row[f"{name}_length_over_shortest"] = result.length_over_shortest
    return {name: round(value, 4) if isinstance(value, float) else value for name, value in row.items()}


def print_medians(rows: list[dict[str, str]]) -> None:
    """Print a line for each mask and graph: medians over its seeds, and the worst success."""
    print("| mask | graph | steps | seeds | steps to 95% | learned | worst | length | random | length |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for cell in sorted({(row["goal_mask"], row["graph"], int(row["steps"])) for row in rows}):
        chosen = [row for row in rows if (row["goal_mask"], row["graph"], int(row["steps"])) == cell]
        to_95, success, length, random_success, random_length = (
            median(float(row[name] or "inf") for row in chosen)
            for name in ("steps_to_95", "learned_success", "learned_length", "random_success", "random_length")
        )
        worst = min(float(row["learned_success"]) for row in chosen)
        print(
            f"| {cell[0]} | {cell[1]} | {cell[2] / 1e6:.1f}M | {len(chosen)} | {in_millions(to_95)} | {success:.1%} | "
            f"{worst:.1%} | {length:.0f} | {random_success:.1%} | {random_length:.0f} |"
        )


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    preset = find_preset("learned").changed(steps=options.steps, threads=1)  # the processes are the parallel part
    runs = []
    for seed, mask, graph in product(range(options.seeds), options.goal_masks, options.graphs):
        config = preset.changed(graph=graph, goal_mask=mask, seed=seed)
        runs.append(({"graph": graph, "goal_mask": mask, "seed": str(seed), "steps": str(options.steps)}, config))
    fill(options.out, runs, partial(train_and_evaluate, episodes=options.episodes), options.processes)
    print_medians(read(options.out))
    return 0


if __name__ == "__main__":
    run(main)
