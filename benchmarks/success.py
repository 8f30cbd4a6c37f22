"""Success of training runs: one row a run, for every method, graph and seed asked for.

    python benchmarks/success.py --preset large --seeds 2 --steps 3_000_000 --out benchmarks/results/size31.csv

Each run trains from scratch and is then evaluated apart from training, with sampled and with greedy actions. A fully
informed controller is given the same goals in the same levels and goes the shortest way to each. Rows that the file
already holds are not run again, so a table that was stopped goes on where it was. At the end the medians over the seeds
are printed, as Markdown.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median

import tyro
from informed import Informed
from run_table import fill, in_millions, train

from hierroom.cli import run
from hierroom.errors import InputError
from hierroom.meta import make_meta
from hierroom.training.config import TrainConfig
from hierroom.training.evaluation import evaluate
from hierroom.training.presets import find_preset

KEYS = ("preset", "method", "meta", "graph", "size", "drop_key", "seed", "steps")


@dataclass(frozen=True)
class Options:
    """Train and evaluate a table of runs."""

    out: Path
    """The CSV file, made or gone on with."""
    preset: str = "default"
    """What every run starts from."""
    methods: tuple[str, ...] = ("hippo",)
    """Methods to train."""
    meta: str | None = None
    """Another meta-controller than the method's own, not a learned one."""
    graphs: tuple[str, ...] = ("a", "b", "c", "d", "e", "f", "g")
    """Goal graphs to train on."""
    seeds: int = 5
    """Seeds 0, 1, ... of each."""
    steps: int = 1_000_000
    """Primitive steps of each run."""
    size: int | None = None
    """Another grid size than the preset's."""
    drop_key: bool = False
    """With the drop action."""
    episodes: int = 1000
    """Episodes of each evaluation."""
    processes: int = os.cpu_count() or 1
    """Runs at a time."""


def configs(options: Options) -> Iterator[TrainConfig]:
    """The runs of the table."""
    preset = find_preset(options.preset)
    meta = options.meta or preset.agents.meta
    if meta == "learned":
        raise InputError("a learned meta-controller gives goals out of reach too; see benchmarks/sweeps/learned.toml")
    for seed, graph, method in product(range(options.seeds), options.graphs, options.methods):
        yield preset.changed(
            method=method,
            meta=meta,
            graph=graph,
            size=options.size or preset.env.size,
            drop_key=options.drop_key,
            seed=seed,
            steps=options.steps,
            threads=1,  # the processes are the parallel part
        )


def key_of(options: Options, config: TrainConfig) -> dict[str, str]:
    """What tells a row from the others, as text."""
    entries = {**config.entries, "preset": options.preset, "meta": config.resolved_method.meta}
    return {key: str(entries[key]) for key in KEYS}


def train_and_evaluate(config: TrainConfig, episodes: int) -> dict[str, object]:
    """The numbers of one run."""
    trainer, numbers = train(config)
    num_envs, seed = min(100, episodes), config.seed
    for name in ("sampled", "greedy"):
        pair = trainer.freeze(num_envs, seed=config.seed, is_greedy=name == "greedy")
        result = evaluate(pair, trainer.fresh_turns(num_envs, seed), episodes)
        numbers[f"{name}_success"] = result.success_rate
        numbers[f"{name}_length"] = result.length
        numbers[f"{name}_length_over_shortest"] = result.length_over_shortest
    informed = Informed(make_meta(config.resolved_method.meta), num_envs)
    numbers["informed_length"] = evaluate(informed, trainer.fresh_turns(num_envs, seed), episodes).length
    return {name: round(value, 4) if isinstance(value, float) else value for name, value in numbers.items()}


def print_medians(rows: list[dict[str, str]]) -> None:
    """Print a line for each method and graph: medians over its seeds, and the worst of them."""
    print(
        "| method | graph | seeds | steps to 95% | to 99% | worst | success | worst | length | over informed | "
        "greedy success |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )
    for method, graph in dict.fromkeys((row["method"], row["graph"]) for row in sorted(rows, key=lambda r: r["graph"])):
        chosen = [row for row in rows if (row["method"], row["graph"]) == (method, graph)]
        names = ("steps_to_95", "steps_to_99", "sampled_success", "sampled_length", "informed_length", "greedy_success")
        numbers = {name: [float(row[name] or "inf") for row in chosen] for name in names}
        to_95, to_99, success, length, informed, greedy = (median(numbers[name]) for name in names)
        print(
            f"| {method} | {Path(graph).stem} | {len(chosen)} | {in_millions(to_95)} | {in_millions(to_99)} | "
            f"{in_millions(max(numbers['steps_to_99']))} | {success:.1%} | {min(numbers['sampled_success']):.1%} | "
            f"{length:.0f} | {length / informed:.2f} | {greedy:.1%} |"
        )


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__, config=(tyro.conf.OmitArgPrefixes,))
    runs = [(key_of(options, config), config) for config in configs(options)]
    print_medians(fill(options.out, runs, partial(train_and_evaluate, episodes=options.episodes), options.processes))
    return 0


if __name__ == "__main__":
    run(main)
