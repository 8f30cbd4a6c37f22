"""Pictures of reach curves: the probability to escape within t steps, for chains and for episodes."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from hierroom.complexity.observed import wilson_interval
from hierroom.complexity.played_chain import PlayedChain

POINTS, COLOUR = 200, "#35a853"


def figure_of_reach(report: PlayedChain) -> Figure:
    """Return the figure of the reach curves of episodes up to their longest, with Wilson's interval, and of chains.

    The chains are the one measured from the episodes, and the assumed walk if there is one.
    """
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes, times = figure.subplots(), np.unique(np.linspace(0, report.counts.lengths.max(), POINTS).astype(int))
    shares = report.empirical_reach(times)
    seen = ~np.isnan(shares)  # up to the step limit
    low, high = np.transpose([wilson_interval(share, report.episodes, report.level)[1:] for share in shares[seen]])
    axes.fill_between(times[seen], low, high, color=COLOUR, alpha=0.25, linewidth=0)
    label = f"{report.episodes} episodes, {100 * report.level:g}% interval"
    axes.plot(times[seen], shares[seen], color=COLOUR, label=label)
    axes.plot(times, report.chain.reach_probability(times), "--", label="their chain")
    if (assumed := report.assumed) is not None:
        axes.plot(times, assumed.chain.reach_probability(times), "--", label="assumed walk")
        axes.set_title(f"goal graph {assumed.graph.name}", parse_math=False)
    axes.set_xlabel("steps")
    axes.set_ylabel("probability of exit")
    axes.set_ylim(-0.02, 1.02)  # so that a curve that stays at zero can be seen
    axes.legend(frameon=False)
    return figure
