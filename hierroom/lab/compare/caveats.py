"""Notes for the reader of a comparison on differences between runs that may mislead."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from hierroom.lab.compare.comparison import Comparison, level_metric
from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.lab.compare.grouping import Group, describe_differences, shortened
from hierroom.lab.compare.tasks import OWN, Tasks, graphs_of

_SHOWN = 3
_FEW_RUNS = 5  # with fewer on a graph, 95% intervals contain the true value too rarely: with three in 74% of cases


def caveats(comparison: Comparison) -> list[str]:
    """Return notes on what limits the comparison of the groups."""
    groups, tasks = comparison.groups, comparison.tasks
    runs = [run for group in groups for run in group.runs]
    lines = [
        *describe_differences(groups, comparison.by),
        *_on_start(runs, comparison),
        *_on_lengths(runs, comparison.summaries[0].steps[-1]),
        *_on_graphs(groups, tasks),
        *_on_seeds(groups, tasks),
        *_on_unknown(comparison),
    ]
    if level_metric(comparison.metric, groups) == "success_rate":
        judged = ((f"{one.group.label} on {one.graph}", one.judged()) for one in comparison.summaries)
        lines += [f"{where}: {text}" for where, text in judged if text]
    counts = {max(run.episodes) for run in runs}  # as planned; evaluations of failing agents may have fewer
    if len(counts) > 1:
        lines.append(f"the evaluations are not alike: they have {min(counts):,} to {max(counts):,} episodes each")
    rewards = sorted({run.reward for run in runs})
    if comparison.metric == "return" and len(rewards) > 1:
        lines.append(f"returns of different rewards ({', '.join(rewards)}) are not comparable; success_rate is")
    return lines


def _on_start(runs: Sequence[EvaluatedRun], comparison: Comparison) -> Iterable[str]:
    tasks, metric, start = comparison.tasks, comparison.metric, comparison.summaries[0].steps[0]
    if min(float(row["steps"]) for run in runs for row in run.rows) < start:
        firsts = {run.path: [tasks.curve(run, graph, metric).steps[0] for graph in tasks.on(run)] for run in runs}
        latest = next(path for path, steps in firsts.items() if start in steps)
        yield f"compared from {start:,.0f} steps on, as earlier evaluations of {latest} lack some of its {tasks.kind}s"


def _on_lengths(runs: Sequence[EvaluatedRun], end: float) -> Iterable[str]:
    unfinished = [run for run in runs if run.evaluated_steps < run.entries["steps"]]
    if unfinished:
        texts = [f"{run.path} ({run.evaluated_steps:,.0f} of {run.entries['steps']:,} steps)" for run in unfinished]
        yield f"unfinished: {shortened(texts, _SHOWN)}"
    planned = [run.entries["steps"] for run in runs]
    if min(planned) < max(planned):
        yield f"the runs are to train for {min(planned):,} to {max(planned):,} steps"
    if max(run.last_steps for run in runs) > 1.01 * end:  # runs end with whole updates, at slightly different steps
        shortest = min(runs, key=lambda run: run.last_steps)
        yield f"compared up to {end:,.0f} steps, the end of {shortest.path}; what others have after that is not used"


def _on_unknown(comparison: Comparison) -> Iterable[str]:
    tasks, metric, steps = comparison.tasks, comparison.metric, comparison.summaries[0].steps
    for group in comparison.groups:
        unknown = {
            run.path: np.isnan([tasks.curve(run, graph, metric).at(steps) for graph in tasks.on(run)]).any(axis=0)
            for run in group.runs
            if tasks.on(run)
        }
        if n_steps := int(np.any([*unknown.values()], axis=0).sum()):
            names = shortened([str(path) for path, is_unknown in unknown.items() if is_unknown.any()], _SHOWN)
            yield f"{group.label} has no {metric} at {n_steps} of {len(steps)} steps, nor an area: not known of {names}"


def _on_graphs(groups: Sequence[Group], tasks: Tasks) -> Iterable[str]:
    if tasks.graphs == (OWN,):
        why = f"each run is compared on its own, as --by {tasks.kind} wants it"
        yield f"the groups have no {tasks.called} in common: {why}"
    elif left_out := sorted(set.union(*graphs_of(groups)) - set(tasks.graphs)):
        yield f"left out, as not every group has it: {tasks.kind} {shortened(left_out, _SHOWN)}"
    met = {row["graph"] for group in groups for run in group.runs for row in run.rows}
    if once := sorted(met - set.union(*graphs_of(groups))):
        yield f"not compared, as no run met it in two evaluations: {tasks.kind} {shortened(once, _SHOWN)}"


def _on_seeds(groups: Sequence[Group], tasks: Tasks) -> Iterable[str]:
    few = []
    for group in groups:
        counts = {graph: sum(graph in tasks.on(run) for run in group.runs) for graph in tasks.graphs}
        alike = Counter(filter(None, map(tasks.on, group.runs)))  # numbers of runs that are resampled together
        single = [graph for graph, count in counts.items() if count == 1]
        if single:
            where = "" if len(counts) == 1 else f" on {tasks.kind} {shortened([*map(str, single)], _SHOWN)}"
            yield f"{group.label} has a single run{where}: no interval, as nothing tells how much seeds differ"
        elif 1 in alike.values():
            path = next(run.path for run in group.runs if alike[tasks.on(run)] == 1)
            yield f"{group.label} has no interval over all {tasks.kind}s: no other run has exactly those of {path}"
        elif min(counts.values()) < _FEW_RUNS:
            few.append(f"{group.label} ({min(counts.values())})")
        if len(set(counts.values())) > 1:
            numbers = shortened([f"{count} on {graph}" for graph, count in counts.items()], _SHOWN)
            weigh = f"{tasks.kind}s with more runs weigh more over all"
            yield f"{group.label} has unequal numbers of runs ({numbers}); {weigh}"
    if few:
        yield f"intervals from fewer than {_FEW_RUNS} runs on a {tasks.kind} are too narrow: {shortened(few, _SHOWN)}"
