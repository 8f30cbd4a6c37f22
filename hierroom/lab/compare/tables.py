"""The numbers of a comparison as rows, for CSV and JSON, and as tables to be read."""

from __future__ import annotations

import math

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from hierroom.lab.compare.comparison import ALL, SUCCESS_LEVELS, Comparison, GroupSummary
from hierroom.lab.compare.estimates import Estimate
from hierroom.lab.compare.metric import METRICS, Metric
from hierroom.lab.compare.tasks import OWN

Row = dict[str, object]

MAX_PAIRS = 15
"""Pairs of groups that are printed; there may be more in improvement.csv."""


def curve_rows(comparison: Comparison) -> list[Row]:
    """A row for each group, graph (or all) and number of steps: the interquartile mean and its interval."""
    return [
        {
            **_group(summary),
            "graph": summary.graph,
            "steps": int(steps),
            "iqm": _rounded(summary.curve.values[n]),
            "low": _rounded(summary.curve.lows[n]),
            "high": _rounded(summary.curve.highs[n]),
            "n_runs": summary.n_runs,
        }
        for summary in comparison.summaries
        for n, steps in enumerate(summary.steps)
    ]


def summary_rows(comparison: Comparison) -> list[Row]:
    """A row for each group and graph (or all): final score, area under the curve, steps to levels of success."""
    return [
        {
            **_group(summary),
            "graph": summary.graph,
            "n_runs": summary.n_runs,
            "n_seeds": summary.n_seeds,
            "n_scores": summary.n_scores,
            "steps": int(summary.steps[-1]),
            **_columns("final_iqm", summary.curve, -1),
            **_columns("final_mean", summary.final_mean),
            **_columns("auc_iqm", summary.auc),
            **_columns("auc_mean", summary.auc_mean),
            **{f"steps_to_{100 * level:.0f}": _rounded(summary.steps_to[level]) for level in SUCCESS_LEVELS},
            **{f"reached_{100 * level:.0f}": _rounded(summary.reached[level]) for level in SUCCESS_LEVELS},
        }
        for summary in comparison.summaries
    ]


def improvement_rows(comparison: Comparison) -> list[Row]:
    """A row for each pair of groups and score: how likely a run of the first is better than one of the second."""
    return [
        {
            "group": one.better.label,
            "other": one.worse.label,
            "score": one.score,
            **_columns("probability", one.probability),
        }
        for one in comparison.improvements
    ]


def summary_table(comparison: Comparison) -> Table:
    """What is estimated of each group over all graphs."""
    metric, graphs = METRICS[comparison.metric], comparison.tasks.graphs
    end = comparison.summaries[0].steps[-1]
    where = f"graph {graphs[0]}" if len(graphs) == 1 else f"{len(graphs)} graphs"
    where = "graphs of their own" if graphs == (OWN,) else where
    table = Table(
        title=escape(f"{metric.label} on {where}, by {', '.join(comparison.by)}"),
        caption="interquartile means with 95% intervals"
        + ("" if metric.is_higher_better else ", less is better")
        + "; steps until the success rate is that high, medians of the runs",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=0,  # so that names of groups fit into 80 columns
    )
    table.add_column("group", overflow="fold", min_width=14)
    for heading in ("runs", f"after {_steps(end)}", "area under\nthe curve"):
        table.add_column(heading, justify="right", no_wrap=True)
    for level in SUCCESS_LEVELS:
        table.add_column(f"steps to\n{level:.0%}", justify="right", no_wrap=True)
    for summary in comparison.of_graph(ALL):
        table.add_row(
            escape(summary.group.label),
            str(summary.n_runs),
            _with_interval(summary.curve, metric, -1),
            _with_interval(summary.auc, metric),
            *(_censored(summary.steps_to[level], summary.reached[level], end) for level in SUCCESS_LEVELS),
        )
    return table


def improvement_table(comparison: Comparison) -> Table:
    """How likely a run of one group is better than one of another, for the first `MAX_PAIRS` pairs."""
    table = Table(
        title="probability that a run of the first group is better",
        caption="with 95% intervals; 0.5: as good",
        caption_justify="left",
        box=SIMPLE_HEAD,
    )
    table.add_column("first", overflow="fold")
    table.add_column("second", overflow="fold")
    table.add_column("at the end", justify="right", no_wrap=True)
    table.add_column("area under the curve", justify="right", no_wrap=True)
    finals, areas = ([i for i in comparison.improvements if i.score == score] for score in ("final", "auc"))
    for final, area in [*zip(finals, areas, strict=True)][:MAX_PAIRS]:
        cells = [_probability(one.probability) for one in (final, area)]
        table.add_row(escape(final.better.label), escape(final.worse.label), *cells)
    return table


def _group(summary: GroupSummary) -> Row:
    """The group's name and choices; ``graph`` and ``steps`` of the config are told from those of the row."""
    choices = summary.group.choices.items()
    return {
        "group": summary.group.label,
        **{f"config_{name}" if name in ("graph", "steps") else name: value for name, value in choices},
    }


def _columns(name: str, estimate: Estimate, n: int = 0) -> Row:
    return {
        name: _rounded(estimate.values[n]),
        f"{name}_low": _rounded(estimate.lows[n]),
        f"{name}_high": _rounded(estimate.highs[n]),
    }


def _rounded(value: float) -> float:
    """To six digits, as few runs decide two; NaN for infinity, as a file has no number for it."""
    return float(f"{value:.6g}") if math.isfinite(value) else math.nan


def _with_interval(estimate: Estimate, metric: Metric, n: int = 0) -> str:
    value, low, high = (metric.scale * float(part[n]) for part in (estimate.values, estimate.lows, estimate.highs))
    if math.isnan(value):
        return "-"
    text = f"{value:.{metric.digits}f}" + ("%" if metric.is_rate else "")
    return text if math.isnan(low) else f"{text}\n\\[{low:.{metric.digits}f}, {high:.{metric.digits}f}]"


def _probability(estimate: Estimate) -> str:
    value, low, high = (float(part[0]) for part in (estimate.values, estimate.lows, estimate.highs))
    if math.isnan(value):
        return "-"
    return f"{value:.2f}" + ("" if math.isnan(low) else f" \\[{low:.2f}, {high:.2f}]")


def _censored(steps: float, reached: float, end: float) -> str:
    """``-`` where no run was that good, ``>1.00M`` where half or fewer were."""
    if math.isfinite(steps):
        return _steps(steps)
    return f">{_steps(end)}" if reached else "-"


def _steps(steps: float) -> str:
    if steps >= 1e6:
        return f"{steps / 1e6:.2f}M"
    return f"{steps / 1e3:.0f}k" if steps >= 10_000 else f"{steps:,.0f}"
