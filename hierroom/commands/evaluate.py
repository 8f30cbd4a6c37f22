"""Evaluate a trained agent: ``python -m hierroom evaluate RUN``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from statistics import mean
from typing import TYPE_CHECKING

from rich.box import HEAVY_HEAD

from hierroom.commands.agent_arguments import AgentArguments
from hierroom.support.cli import Flag, progress_bar, read_arguments
from hierroom.support.errors import one_line, require_number
from hierroom.support.files import to_json
from hierroom.support.tables import named_table, print_table
from hierroom.worlds.env_config import MOST_ENVS

if TYPE_CHECKING:
    from rich.table import Table

    from hierroom.agents.evaluation import Evaluation, Score

MOST_EPISODES = 1000
"""The most episodes to play by default."""


@dataclass(frozen=True)
class EvaluateArguments(AgentArguments):
    """Evaluate a trained agent: success, length and steps to each goal, with sampled and with greedy actions.

    Args:
        episodes: episodes to play; by default 1000, or fewer once the success rate of a failing agent is clear.
        num_envs: number of environments that play in parallel.
        json: print JSON for machines; missing values, such as the mean step of a goal never reached, are null.
    """

    episodes: int | None = None
    num_envs: int = 100
    json: Flag = False


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(EvaluateArguments, "evaluate", argv)
    for name, most in (("episodes", 10**9), ("num_envs", MOST_ENVS)):
        if getattr(arguments, name) is not None:
            require_number(name, getattr(arguments, name), 1, most, is_whole=True)
    episodes, may_stop = arguments.episodes or MOST_EPISODES, arguments.episodes is None
    from hierroom.agents.evaluation import evaluate

    agent = arguments.load()
    num_envs, seed = min(arguments.num_envs, episodes), arguments.seed
    players = {"sampled": agent, "greedy": replace(agent, is_greedy=True)}
    turns = {name: agent.turns(num_envs, seed=seed, env=arguments.env(agent)) for name in players}
    arguments.warn_of_changes(agent)
    results: dict[str, Evaluation] = {}
    with progress_bar() as bar:
        for name, player in players.items():
            task = bar.add_task(f"{name} actions", total=episodes)
            pair, show = player.pair(num_envs, seed=seed), lambda done, task=task: bar.update(task, completed=done)
            results[name] = evaluate(pair, turns[name], episodes, show, may_stop=may_stop)
    if arguments.json:
        print(to_json({name: asdict(result) for name, result in results.items()}))
        return 0
    known, what = turns["sampled"].world.variants, turns["sampled"].config.kind
    graphs = [name for name in known if any(name in result.graphs for result in results.values())]
    where = f"{what} {graphs[0]}" if len(known) == 1 else f"{len(graphs)} {what}s"
    if len(known) > len(graphs):
        where = f"{len(graphs)} of {len(known)} {what}s (the others had no episode)"
    print(one_line(f"{arguments.run} on {where}"))  # somebody else may have named the run
    print_table(_table(results))
    if len(graphs) > 1:
        print_table(_graph_table(results, graphs, what))
    return 0


def _table(results: Mapping[str, Evaluation]) -> Table:
    texts: dict[str, Callable[[Evaluation], str]] = {
        "episodes": lambda r: str(r.episodes),
        "success": lambda r: f"{r.success_rate:.1%}",
        "  95% interval": lambda r: "{:.1%} to {:.1%}".format(*r.success_interval),
        "length": lambda r: f"{r.length:.1f}",
        "length / shortest, successes": lambda r: _number(r.length_over_shortest, ".2f"),
        "return of the controller": lambda r: f"{r.mean_return:.2f}",
    }
    if all(math.isnan(result.success_rate) for result in results.values()):
        score: dict[str, Callable[[Evaluation], str]] = {
            "score (geometric mean of the goals)": lambda r: f"{r.score:.1%}",
            "mean of the goals": lambda r: f"{mean(goal.fraction for goal in r.steps_to_goals.values()):.1%}",
        }
        texts = {name: texts[name] for name in ("episodes", "return of the controller", "length")}
        texts |= score if any(result.steps_to_goals for result in results.values()) else {}
    for goal in dict.fromkeys(goal for result in results.values() for goal in result.steps_to_goals):
        texts[f"steps to {goal}"] = lambda r, g=goal: (
            f"{_number(r.steps_to_goals[g][1])} ({r.steps_to_goals[g][0]:.1%})" if g in r.steps_to_goals else "-"
        )
    rows = ([label, *map(text, results.values())] for label, text in texts.items())
    return named_table(["", *(f"{name} actions" for name in results)], rows, box=HEAVY_HEAD, padding=(0, 1))


def _number(value: float, style: str = ".1f") -> str:
    return "-" if math.isnan(value) else format(value, style)


def _graph_table(results: Mapping[str, Evaluation], graphs: Sequence[str], kind: str) -> Table:
    def cells(score: Score | None) -> list[str]:
        if score is None:  # a player that fails stops early, perhaps before its first episode there
            return ["0", "-", "-", "-"]
        low, high = score.success_interval
        return [str(score.episodes), f"{score.success_rate:.1%}", f"{low:.0%}-{high:.0%}", f"{score.length:.0f}"]

    rows = [[name, *(cell for one in results.values() for cell in cells(one.graphs.get(name)))] for name in graphs]
    headings = [f"{name}\n{what}" for name in results for what in ("episodes", "success", "interval", "length")]
    return named_table([kind, *headings], rows)
