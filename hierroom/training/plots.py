"""Plots of a training run."""

from __future__ import annotations

import io
from pathlib import Path

from hierroom.files import write_atomically
from hierroom.training.run_folder import RunFolder


def plot_learning_curve(run: RunFolder, path: Path) -> None:
    """Plot success rate and episode length over the steps trained, as a PNG.

    Args:
        run: folder of the run.
        path: the file to write.

    Raises:
        InputError: if the plot cannot be written.
    """
    from matplotlib.figure import Figure  # imported here, because it loads slowly

    rows = run.metrics.numbers()
    steps = [row["steps"] / 1e6 for row in rows]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    success, length = figure.subplots(1, 2)
    success.plot(steps, [100 * row["success_rate"] for row in rows], color="tab:green")
    success.set(ylim=(0, 101), ylabel="success (%)", title="reached the exit")
    length.plot(steps, [row["episode_length"] for row in rows], color="tab:blue")
    length.set(ylim=(0, None), ylabel="steps", title="episode length")
    for axes in (success, length):
        axes.set_xlabel("primitive steps (millions)")
        axes.grid(alpha=0.3)
    figure.suptitle(f"{run.path.name}: mean over the last 500 episodes")
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=120)
    write_atomically(path, picture.getvalue())
