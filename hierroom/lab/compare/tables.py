"""The numbers of a comparison as rows, for CSV and JSON, and as tables for the terminal."""

from __future__ import annotations

import math
from functools import partial

from rich.markup import escape
from rich.table import Table

from hierroom.lab.compare.comparison import SCORES, SUCCESS_LEVELS, Comparison, GroupSummary, level_metric
from hierroom.lab.compare.curve import metric_of
from hierroom.lab.compare.estimates import Estimate
from hierroom.lab.compare.tasks import ALL, OWN
from hierroom.lab.sweep.summary import steps_text
from hierroom.support.tables import named_table

Row = dict[str, object]

MAX_PAIRS = 15  # pairs of groups that are printed; improvement.csv has all


def curve_rows(comparison: Comparison) -> list[Row]:
    """Return a row for each group, graph (or all) and number of steps: the interquartile mean and its interval."""
    return [
        {
            **_group(summary),
            "graph": str(summary.graph),
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
    """Return a row for each group and graph (or all): final score, area under the curve, steps to success levels."""
    return [
        {
            **_group(summary),
            "graph": str(summary.graph),
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
    """Return a row for each pair of groups and score: how likely a run of the first group is better."""
    return [
        {"group": i.better.label, "other": i.worse.label, "score": score, **_columns("probability", i.probability, n)}
        for i in comparison.improvements
        for n, score in enumerate(SCORES)
    ]


def summary_table(comparison: Comparison) -> Table:
    """Return a table of the estimates of each group over all graphs."""
    metric, graphs, kind = metric_of(comparison.metric), comparison.tasks.graphs, comparison.tasks.kind
    end = comparison.summaries[0].steps[-1]
    where = f"{kind} {graphs[0]}" if len(graphs) == 1 else f"{len(graphs)} {kind}s"
    where = f"{kind}s of their own" if graphs == (OWN,) else where
    title = escape(f"{metric.label} on {where}, by {', '.join(comparison.by)}")
    caption = f"interquartile means with 95% intervals{'' if metric.is_higher_better else ', less is better'}"
    counted = metric_of(level_metric(comparison.metric, comparison.groups))
    level = f"{counted.label} is that high"
    level = level if counted.is_rate else "return is so far from the lowest first to the best last"
    caption += f"; steps until the {level}, medians over runs{f' and {kind}s' * (len(graphs) > 1)}"
    caption += f" (>{steps_text(end)}: half or fewer got there, -: none)"
    levels = [f"steps to\n{level:.0%}" for level in SUCCESS_LEVELS]
    unit = "%" if metric.is_rate else ""
    shown = partial(_with_interval, digits=metric.digits, gap="\n", scale=metric.scale, unit=unit)
    rows = [
        [
            summary.group.label,
            str(summary.n_runs),
            shown(summary.curve, -1),
            shown(summary.auc, 0),
            *(_censored(summary.steps_to[level], summary.reached[level], end) for level in SUCCESS_LEVELS),
        ]
        for summary in comparison.of_graph(ALL)
    ]
    headings = ["group", "runs", f"after {steps_text(end)}", "area under\nthe curve", *levels]
    table = named_table(headings, rows, title=title, caption=caption, padding=0)  # no padding, as names are long
    table.columns[0].min_width = 14
    return table


def improvement_table(comparison: Comparison) -> Table:
    """Return a table of the first `MAX_PAIRS` pairs of groups: how likely a run of one is better than of the other."""
    rows = [
        [i.better.label, i.worse.label, *(_with_interval(i.probability, n, 2, " ") for n in range(len(SCORES)))]
        for i in comparison.improvements[:MAX_PAIRS]
    ]
    title = "probability that a run of the first group is better"
    headings = ["first", "second", "at the end", "area under the curve"]
    return named_table(headings, rows, 2, title=title, caption="with 95% intervals; 0.5: as good")


def _group(summary: GroupSummary) -> Row:
    choices = summary.group.choices.items()
    own = {f"config_{name}" if name in ("graph", "steps") else name: value for name, value in choices}
    return {"group": summary.group.label, **own}


def _columns(name: str, estimate: Estimate, n: int = 0) -> Row:
    ends = (("", estimate.values), ("_low", estimate.lows), ("_high", estimate.highs))
    return {f"{name}{end}": _rounded(part[n]) for end, part in ends}


def _rounded(value: float) -> float:
    """Round to six digits, more than few runs can determine; NaN for infinity, for which files have no number."""
    return float(f"{value:.6g}") if math.isfinite(value) else math.nan


def _with_interval(estimate: Estimate, n: int, digits: int, gap: str, scale: float = 1.0, unit: str = "") -> str:
    value, low, high = (scale * float(part[n]) for part in (estimate.values, estimate.lows, estimate.highs))
    if math.isnan(value):
        return "-"
    text = f"{value:.{digits}f}{unit}"
    return text if math.isnan(low) else f"{text}{gap}[{low:.{digits}f}, {high:.{digits}f}]"


def _censored(steps: float, reached: float, end: float) -> str:
    if math.isfinite(steps):
        return steps_text(steps)
    return f">{steps_text(end)}" if reached else "-"
