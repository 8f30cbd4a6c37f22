"""When a run is logged, evaluated and saved: this depends on the steps alone, so a resumed run keeps to it."""

from __future__ import annotations

from dataclasses import dataclass

from hierroom.runs.logs.learning_curve import evaluation_points

ROWS, CHECKPOINTS = 500, 10


@dataclass(frozen=True)
class Schedule:
    """What is due after an update, by the steps taken before the update and after it."""

    steps: int  # of the whole run
    evaluations: int  # in addition to the one before training

    def is_row_due(self, before: int, now: int) -> bool:
        """Whether to write a row of ``metrics.csv``: after the first update, and 500 times a run."""
        return before == 0 or self._passes(ROWS, before, now)

    def is_checkpoint_due(self, before: int, now: int) -> bool:
        """Whether to write a checkpoint: ten times a run."""
        return self._passes(CHECKPOINTS, before, now)

    def is_evaluation_due(self, before: int, now: int) -> bool:
        """Whether to evaluate the agents; the evaluation before training is due from -1 to 0."""
        return any(before < point <= now for point in evaluation_points(self.steps, self.evaluations))

    def _passes(self, parts: int, before: int, now: int) -> bool:
        return before * parts // self.steps < now * parts // self.steps
