"""When a run is logged, evaluated and saved: by the steps taken alone, so that a resumed run goes on with it."""

from __future__ import annotations

from dataclasses import dataclass

from hierroom.runs.logs.learning_curve import evaluation_points

ROWS, CHECKPOINTS = 500, 10


@dataclass(frozen=True)
class Schedule:
    """What is due after an update.

    Each method takes the steps taken before the update and after it.

    Args:
        steps: of the whole run.
        evaluations: how many besides the one before training.
    """

    steps: int
    evaluations: int

    def is_row_due(self, before: int, now: int) -> bool:
        """Whether a row of ``metrics.csv`` is to be written: after the first update, and 500 times a run."""
        return before == 0 or self._passes(ROWS, before, now)

    def is_checkpoint_due(self, before: int, now: int) -> bool:
        """Whether a checkpoint is to be written: ten times a run."""
        return self._passes(CHECKPOINTS, before, now)

    def is_evaluation_due(self, before: int, now: int) -> bool:
        """Whether the agents are to be evaluated; for the evaluation before training, ask from -1 to 0."""
        return any(before < point <= now for point in evaluation_points(self.steps, self.evaluations))

    def _passes(self, parts: int, before: int, now: int) -> bool:
        """Whether the run, cut into equal parts, has completed one of them since ``before``."""
        return before * parts // self.steps < now * parts // self.steps
