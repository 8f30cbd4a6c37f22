"""What TensorBoard shows of a run, in groups."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from hierroom.training.config import TrainConfig
from hierroom.training.episode_log import MILESTONES
from hierroom.training.evaluation import Evaluation, Score
from hierroom.training.learning_curve import LearningCurve

GROUPS: Mapping[str, tuple[str, ...]] = {
    "time": ("seconds", "compile_seconds", "steps_per_second"),
    "train": ("episodes", "success_rate", "episode_length", "episode_return", "stage"),
}
"""The tags of the entries of ``metrics.csv`` begin with these; those of others with the agent that they tell of."""


def tag(name: str) -> str:
    """The tag of an entry of ``metrics.csv``: that of ``meta_entropy`` is ``meta/entropy``."""
    for group, names in GROUPS.items():
        if name in names:
            return f"{group}/{name}"
    return f"meta/{name.removeprefix('meta_')}" if name.startswith("meta_") else f"controller/{name}"


class Events:
    """Writes the TensorBoard events of a run.

    Args:
        path: the run's folder.
        config: the run's config.
    """

    def __init__(self, path: Path, config: TrainConfig) -> None:
        self._writer = SummaryWriter(str(path))
        self._config = config

    def __enter__(self) -> Events:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._writer.close()

    def add_metrics(self, row: Mapping[str, float]) -> None:
        """Show a row of ``metrics.csv``."""
        for name, value in row.items():
            if name != "steps":
                self._writer.add_scalar(tag(name), value, int(row["steps"]))

    def add_evaluation(self, steps: int, evaluation: Evaluation) -> None:
        """Show an evaluation: in all, by goal, and where there are several goal graphs by graph."""
        self._add_score("eval", evaluation, steps)
        for goal, (share, _) in evaluation.steps_to_goals.items():
            self._writer.add_scalar(f"eval/achieved/{goal.replace(' ', '_')}", share, steps)
        if len(evaluation.graphs) > 1:
            for graph, score in evaluation.graphs.items():
                self._add_score(f"eval/graph/{graph}", score, steps)

    def _add_score(self, group: str, score: Score, steps: int) -> None:
        numbers = {"success_rate": score.success_rate, "length": score.length, "return": score.mean_return}
        for name, value in (numbers | {"length_over_shortest": score.length_over_shortest}).items():
            self._writer.add_scalar(f"{group}/{name}", value, steps)

    def add_hyperparameters(self, curve: LearningCurve | None) -> None:
        """Show the run's config beside how it ended, in TensorBoard's table of runs."""
        entries = {name: value for name, value in self._config.entries.items() if name not in ("env", "agents", "ppo")}
        plain = {
            name: value if isinstance(value, (bool, int, float, str)) else str(value) for name, value in entries.items()
        }
        ends = {}
        if curve is not None:
            ends = {"eval/success_rate": curve.success[-1], "eval/length": curve.length[-1]}
            crossings = {milestone: curve.first_crossing(milestone) for milestone in MILESTONES}
            ends |= {f"eval/steps_to_{name}": at[0] for name, at in crossings.items() if at is not None}
        assert self._writer.file_writer is not None
        for summary in hparams(plain, ends):
            self._writer.file_writer.add_summary(summary)
        for name, value in ends.items():
            if "steps_to" in name:
                self._writer.add_scalar(name, value, self._config.steps)
