"""The score of a trial of a search: a mean over its runs, from 0 to 1, of what their learning curves enclose."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.learning_curve import LearningCurve

Reference = tuple[float, float] | None
"""Of a run whose return counts, in the first trial: the return before training, and the range of returns later."""


def reference_of(folder: Path) -> Reference:
    """Return the reference of a run, None if it has a success rate or a score."""
    curve = _curve(folder)
    return None if curve is None or curve.is_rate else (float(curve.returns[0]), float(np.ptp(curve.returns)))


def scores_so_far(folders: Sequence[Path], points: Sequence[int], references: Sequence[Reference]) -> list[float]:
    """Return the score of a trial at points of its runs in order, up to the first one that is not evaluated yet.

    A run's score is its mean success rate, or score over goals, over its steps, where those to come count as 0. If its
    return counts, it is
    ``gain / (gain + range)``. The gain is its mean return over the steps, above the reference's return before training;
    the range is that of the reference's returns. A negative gain counts as 0.

    Args:
        folders: those of the R runs.
        points: P steps of a run at which it is evaluated, the last one at its end.
        references: those of the R runs.
    """
    scores = []
    for n, (folder, reference) in enumerate(zip(folders, references, strict=True)):
        before, curve = scores[-1] if n else 0.0, _curve(folder)
        low, scale = reference or (0.0, 0.0)
        for point in points:
            if curve is None or curve.steps[-1] < point:
                return scores
            x = np.append(curve.steps[curve.steps < point], point)
            gain = max(0.0, float(np.trapezoid(np.interp(x, curve.steps, curve.outcome) - low, x)) / points[-1])
            score = gain / (gain + scale) if reference and gain else gain
            scores.append(before + score / len(folders))
    return scores


def _curve(folder: Path) -> LearningCurve | None:
    return LearningCurve.of_rows(RunFolder(folder).evaluations.read())
