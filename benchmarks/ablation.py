"""What each entry of the default preset is worth: HiPPO on one graph with one entry changed at a time.

    python benchmarks/ablation.py --out benchmarks/results/ablation.csv

Success and length are those of the last 500 episodes of training. Rows that the file already holds are not run again.
At the end the medians over the seeds are printed, as Markdown.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from statistics import median

import tyro
from run_table import fill, in_millions, train

from hierroom.cli import run
from hierroom.training.config import TrainConfig
from hierroom.training.presets import PRESETS

DEFAULT = PRESETS["default"]
UNCHANGED = "as it is"
CHANGES: dict[str, tuple[object, ...]] = {
    "num_envs": (128,),
    "sequence_length": (16, 128),
    "minibatches": (8,),
    "epochs": (2, 6),
    "learning_rate": (5e-4, 2e-3),
    "final_learning_rate_fraction": (0.0,),
    "adam_epsilon": (1e-8,),
    "max_gradient_norm": (1.0,),
    "clip": (0.1, 0.3),
    "value_weight": (0.5,),
    "entropy_weight": (0.003, 0.03),
    "gamma": (0.9, 0.98, 0.99),
    "gae_lambda": (0.9, 0.98),
    "normalize_advantages": (False,),
    "min_advantage_std": (1e-8,),
    "hidden_size": (32, 128),
}
"""Entry of the config or of its learner to the values tried in place of the preset's."""
LEFT_OUT = DEFAULT.agents.features[2:]
"""Features left out one at a time: all but the view and the goal, without which there is nothing to learn from."""
NAMES_IN_FILE = {"num_envs": "rooms"}
"""Entries that had another name when the first rows were made: in the file they keep it."""


@dataclass(frozen=True)
class Options:
    """Train a table of runs."""

    out: Path
    """The CSV file, made or gone on with."""
    graph: str = "g"
    """Goal graph to train on."""
    seeds: int = 3
    """Seeds 0, 1, ... of each."""
    steps: int = 1_000_000
    """Primitive steps of each run."""
    processes: int = os.cpu_count() or 1
    """Runs at a time."""


def variants(config: TrainConfig) -> Iterator[tuple[str, TrainConfig]]:
    """The config as it is and with each change, by name."""
    yield UNCHANGED, config
    for entry, values in CHANGES.items():
        for value in values:
            yield f"{entry} {value}", config.changed(**{entry: value})
    for left_out in LEFT_OUT:
        yield f"without {left_out}", config.changed(features=tuple(f for f in config.agents.features if f != left_out))


def in_file(change: str) -> str:
    """What a change is called in the file."""
    entry, _, value = change.partition(" ")
    return f"{NAMES_IN_FILE.get(entry, entry)} {value}"


def measure(config: TrainConfig) -> dict[str, object]:
    """The numbers of one run."""
    return train(config)[1]


def print_medians(rows: list[dict[str, str]]) -> None:
    """Print a line for each change: medians over its seeds, and the worst success."""
    print("| change | seeds | steps to 95% | to 99% | success | worst | length |")
    print("|---|---|---|---|---|---|---|")
    for change in dict.fromkeys(name for name, _ in variants(DEFAULT)):
        chosen = [row for row in rows if row["change"] == in_file(change)]
        if not chosen:
            continue
        to_95, to_99, success, length = (
            median(float(row[name] or "inf") for row in chosen)
            for name in ("steps_to_95", "steps_to_99", "success_rate", "episode_length")
        )
        worst = min(float(row["success_rate"]) for row in chosen)
        print(
            f"| {change} | {len(chosen)} | {in_millions(to_95)} | {in_millions(to_99)} | {success:.1%} | {worst:.1%} | "
            f"{length:.0f} |"
        )


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__, config=(tyro.conf.OmitArgPrefixes,))
    base = DEFAULT.changed(graph=options.graph, steps=options.steps, threads=1)  # the processes are the parallel part
    runs = []
    for seed, (name, config) in product(range(options.seeds), variants(base)):
        key = {"change": in_file(name), "graph": options.graph, "seed": str(seed), "steps": str(options.steps)}
        runs.append((key, config.changed(seed=seed)))
    print_medians(fill(options.out, runs, measure, options.processes))
    return 0


if __name__ == "__main__":
    run(main)
