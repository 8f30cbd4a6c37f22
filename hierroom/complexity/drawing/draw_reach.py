"""Pictures of reach curves: the probability to escape within t steps, for chains and for episodes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.drawing.draw import save_figure
from hierroom.complexity.observed import wilson_interval
from hierroom.complexity.played_chain import PlayedChain
from hierroom.support.drawing import legend_text

POINTS = 200


def draw_reach(axes: Axes, chains: Mapping[str, Chain], last: int = 1000, goal: str = EXIT) -> None:
    """Draw the probability that a goal is achieved within 0 to ``last`` steps: one line for each chain, by its name."""
    times = _times(last)
    for name, chain in chains.items():
        axes.plot(times, chain.reach_probability(times, goal), "--", label=legend_text(name))
    axes.set_xlabel("steps")
    axes.set_ylabel(f"probability of {goal}", parse_math=False)
    axes.set_ylim(-0.02, 1.02)  # so that a curve that stays at zero can be seen
    for text in axes.legend(frameon=False).get_texts():
        text.set_parse_math(False)


def draw_played_reach(
    axes: Axes, played: PlayedChain, last: int | None = None, others: Mapping[str, Chain] = MappingProxyType({})
) -> None:
    """Draw the reach curve of a measured chain, and that of its episodes up to their step limit with Wilson's interval.

    Args:
        last: the largest number of steps; None: the length of the longest episode.
        others: more chains to draw, by their names in the legend.
    """
    last = int(played.counts.lengths.max()) if last is None else last
    times = _times(last)
    shares = played.empirical_reach(times)
    seen = ~np.isnan(shares)
    low, high = np.transpose([wilson_interval(share, played.episodes, played.level)[1:] for share in shares[seen]])
    axes.fill_between(times[seen], low, high, color="#35a853", alpha=0.25, linewidth=0)
    label = f"{played.episodes} episodes, {100 * played.level:g}% interval"
    axes.plot(times[seen], shares[seen], color="#35a853", label=label)
    draw_reach(axes, {"their chain": played.chain, **others}, last)


def save_reach(report: PlayedChain, path: str | Path) -> None:
    """Write a picture of the curves of `draw_played_reach` and that of the assumed walk to a file."""
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    assumed = report.assumed
    draw_played_reach(axes, report, others={"assumed walk": assumed.chain} if assumed else {})
    axes.set_title(f"goal graph {assumed.graph.name}" if assumed else "", parse_math=False)
    save_figure(figure, path)


def _times(last: int) -> np.ndarray:
    return np.unique(np.linspace(0, last, POINTS).astype(int))
