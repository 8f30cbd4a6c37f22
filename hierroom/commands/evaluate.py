"""Evaluate a trained agent: ``python -m hierroom evaluate RUN``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from hierroom.goals import GraphSpecs
from hierroom.support.cli import read_arguments
from hierroom.support.errors import require_number
from hierroom.support.files import to_json
from hierroom.support.tables import print_table
from hierroom.worlds.env_config import GRAPHS

if TYPE_CHECKING:
    from hierroom.runs.evaluation import Evaluation


@dataclass(frozen=True)
class EvaluateArguments:
    """Evaluate a trained agent: success, length and steps to each goal, sampling its actions and greedily.

    Args:
        run: the run's folder, the .safetensors file of an agent, or an agent that ships (a to g, learned-g); before
            --graph and --exclude, to which all words up to the next option belong.
        episodes: episodes to play.
        num_envs: environments to play in side by side.
        seed: fixes the levels and the actions; training never sees the levels, whatever its seed.
        graph: other goal graphs than those trained on, given as in training, all of which are played at once.
        exclude: goal graphs to leave out; where --graph is not given, besides those left out in training.
        size: another grid size than the one trained on.
        meta: another meta-controller for the trained controller: fixed-dfs, random, oracle, none, an entry point,
            package.module:Class or package.module:function.
        goal_mask: other goals that may be chosen: reachable, existing, seen or none.
        checkpoint: the steps of an earlier checkpoint than the newest.
        trust_run: run the code that the run's config names beside what ships with hierroom (a network, a reward, a
            meta-controller of somebody's own).
        json: print JSON for machines; what has no value, such as the mean step of a goal never reached, is null.
    """

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    episodes: int = 1000
    num_envs: int = 100
    seed: int = 0
    graph: Annotated[GraphSpecs, GRAPHS] = ()
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    size: int | None = None
    meta: str | None = None
    goal_mask: str | None = None
    checkpoint: int | None = None
    trust_run: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Run the command on its words."""
    arguments = read_arguments(EvaluateArguments, "evaluate", argv)
    for name, most in (("episodes", 10**9), ("num_envs", 2**20)):
        require_number(name, getattr(arguments, name), 1, most, is_whole=True)
    import torch  # it takes its time, and --help needs none of it

    from hierroom.complexity.graph_set import GraphSet
    from hierroom.runs.config.unread_entries import entries_without_effect
    from hierroom.runs.evaluation import evaluate
    from hierroom.runs.folder.provenance import warn_of_changed_modules
    from hierroom.runs.logs.output import warn
    from hierroom.runs.trained_agent import load

    torch.set_num_threads(1)  # as in training
    agent = load(arguments.run, checkpoint=arguments.checkpoint, meta=arguments.meta, trust=arguments.trust_run)
    given = {name: value for name in ("meta", "goal_mask") if (value := getattr(arguments, name)) is not None}
    unread = [name for name in entries_without_effect(agent.config.changed(**given)) if name in given]
    for name in unread:
        warn(f"--{name.replace('_', '-')} has no effect on a controller of the method {agent.config.agents.method}")
    if arguments.graph:
        for note in GraphSet(arguments.graph, arguments.exclude, agent.config.env.drop_key).notes:
            warn(note)
    num_envs, seed = min(arguments.num_envs, arguments.episodes), arguments.seed
    named = {name: getattr(arguments, name) for name in ("graph", "exclude", "size", "goal_mask")}
    chosen: dict[str, Any] = {name: value for name, value in named.items() if value not in (None, ())}
    played = {
        name: (
            agent.turns(num_envs, seed=seed, env=agent.env(**chosen)),
            replace(agent, is_greedy=is_greedy).pair(num_envs, seed=seed),
        )
        for name, is_greedy in (("sampled", False), ("greedy", True))
    }
    # Not before: the turns import a reward of one's own.
    warn_of_changed_modules(arguments.run, agent.config.changed(meta=None) if arguments.meta else agent.config)
    results: dict[str, Evaluation] = {}
    stderr = Console(stderr=True)
    with Progress(console=stderr, transient=True, disable=not stderr.is_terminal) as bar:
        for name, (turns, pair) in played.items():
            task = bar.add_task(f"{name} actions", total=arguments.episodes)
            results[name] = evaluate(
                pair, turns, arguments.episodes, lambda done, t=task: bar.update(t, completed=done)
            )
    if arguments.json:
        print(to_json({name: asdict(result) for name, result in results.items()}))
    else:
        console = Console()
        graphs = results["sampled"].graphs
        n_known = len(played["sampled"][0].world.variants)
        where = f"graph {next(iter(graphs))}" if n_known == 1 else f"{len(graphs)} graphs"
        if n_known > len(graphs):
            where = f"{len(graphs)} of {n_known} graphs (the others had no episode)"
        console.print(escape(f"{arguments.run} on {where}, {results['sampled'].episodes} episodes"), soft_wrap=True)
        print_table(_table(results), console)
        if len(graphs) > 1:
            print_table(_graph_table(results), console)
    return 0


def _table(results: dict[str, Evaluation]) -> Table:
    table = Table()
    table.add_column("")
    for name in results:
        table.add_column(f"{name} actions", justify="right")

    def add(label: str, text) -> None:
        table.add_row(label, *(text(result) for result in results.values()))

    add("success", lambda r: f"{r.success_rate:.1%}")
    add("  95% interval", lambda r: "{:.1%} to {:.1%}".format(*r.success_interval))
    add("length", lambda r: f"{r.length:.1f}")
    add("length / shortest, escapes", lambda r: _number(r.length_over_shortest, ".2f"))
    add("return of the controller", lambda r: f"{r.mean_return:.2f}")
    for goal in results["sampled"].steps_to_goals:
        add(f"steps to {goal}", lambda r, g=goal: _steps_to(*r.steps_to_goals[g]))
    return table


def _steps_to(fraction: float, mean_step: float) -> str:
    return f"{_number(mean_step, '.1f')} ({fraction:.1%})"


def _number(value: float, style: str) -> str:
    """A number, or a dash where there is none."""
    return "-" if math.isnan(value) else format(value, style)


def _graph_table(results: dict[str, Evaluation]) -> Table:
    """A line for each goal graph, the easiest first."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))  # it fits into 80 columns
    table.add_column("graph", overflow="fold")
    table.add_column("episodes", justify="right", no_wrap=True)
    for name in results:
        for what in ("success", "interval", "length"):
            table.add_column(f"{name}\n{what}", justify="right", no_wrap=True)
    for graph, score in results["sampled"].graphs.items():
        cells = [escape(graph), str(score.episodes)]
        for result in results.values():
            of_graph = result.graphs[graph]
            low, high = of_graph.success_interval
            cells += [f"{of_graph.success_rate:.1%}", f"{low:.0%}-{high:.0%}", f"{of_graph.length:.0f}"]
        table.add_row(*cells)
    return table
