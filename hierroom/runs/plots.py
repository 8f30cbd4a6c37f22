"""Plots of a training run."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.episode_log import WINDOW
from hierroom.runs.logs.learning_curve import LearningCurve
from hierroom.support.drawing import drawing
from hierroom.support.errors import one_line
from hierroom.support.files import write_atomically


def plot_learning_curve(run: RunFolder, curve: LearningCurve | None, path: Path) -> None:
    """Plot success rate and episode length over the steps trained, as a PNG; ``curve`` has the evaluations."""
    from matplotlib.figure import Figure  # imported here, because it loads slowly

    rows = run.metrics.numbers()
    unit, name = step_unit(max((row["steps"] for row in rows), default=0))
    steps = [row["steps"] / unit for row in rows]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    panels = figure.subplots(1, 2)
    windows = [100 * row["success_rate"] for row in rows], [row["episode_length"] for row in rows]
    evaluated = None if curve is None else (100 * curve.success, curve.length)
    for n, axes in enumerate(panels):
        axes.plot(steps, windows[n], color="tab:orange", linewidth=1, label=f"training, last {WINDOW} episodes")
        if curve is not None and evaluated is not None:
            axes.plot(curve.steps / unit, evaluated[n], color="tab:blue", marker="o", markersize=3, label="evaluated")
        axes.set_xlabel(f"primitive steps ({name})")
        axes.grid(alpha=0.3)
    panels[0].set(ylim=(-2, 102), ylabel="success (%)", title="reached the target")
    longest = np.nanmax([1, *windows[1], *(() if curve is None else curve.length)])  # NaN before an episode ends
    panels[1].set(ylim=(0, 1.05 * longest), ylabel="steps", title="episode length")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    figure.suptitle(one_line(run.path.name), parse_math=False)
    picture = io.BytesIO()
    with drawing():
        figure.savefig(picture, format="png", dpi=120)
    write_atomically(path, picture.getvalue())


def step_unit(most: float) -> tuple[float, str]:
    """Return the number of steps per unit for an axis that ends at ``most`` steps, and the unit's name."""
    return (1e6, "millions") if most >= 200_000 else (1e3, "thousands")
