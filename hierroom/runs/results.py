"""The results of a run at its end: summary, learning curve, a film of an episode, and a table."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Column, Table

from hierroom.agents.episode import Episode
from hierroom.agents.evaluation import outcome_in_words
from hierroom.agents.playback import save_episodes
from hierroom.runs.folder.predicted import prediction_of
from hierroom.runs.folder.run_folder import FILMS, RunFolder
from hierroom.runs.folder.user_code import trust_option
from hierroom.runs.logs.episode_log import WINDOW
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve
from hierroom.runs.rollout import rollout
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.cli import shell_words
from hierroom.support.errors import InputError, one_line
from hierroom.support.files import delete, write_atomically
from hierroom.support.output import warn
from hierroom.support.pictures import drawing
from hierroom.support.tables import print_table
from hierroom.turns.records import META

MANY_ILLEGAL = 0.1
"""A larger share of illegal goals suggests a mistake in the meta-controller."""
N_PICTURED = 20
"""Number of episodes from which the one for the picture is chosen."""


def write_results(trainer: Trainer, folder: RunFolder, console: Console) -> None:
    """Write the summary and pictures, and print the results."""
    curve, summary = LearningCurve.of_rows(folder.evaluations.read()), trainer.summary()
    for milestone in MILESTONES:
        crossing = curve and curve.crossing(milestone)
        summary |= {f"{name}_to_{milestone}": crossing and getattr(crossing, name) for name in ("steps", "seconds")}
    if curve is not None:
        ends = {"success_rate": curve.success, "length": curve.length, "return": curve.returns}
        ends |= {curve.outcome_name: curve.outcome}
        summary |= {f"evaluated_{name}": float(values[-1]) for name, values in ends.items()}
    folder.save_summary(summary)
    picture, run = folder.path / "learning_curve.png", (folder.path, *trust_option(trainer.config))
    plot_learning_curve(folder, curve, picture)
    console.print(folder.path.name, soft_wrap=True, markup=False)
    print_table(_table(curve, summary), console)
    if (predicted := prediction_of(folder.path)) and curve is not None and curve.outcome_name == "success_rate":
        took = {n: np.inf if (steps := summary[f"steps_to_{n}"]) is None else steps for n in MILESTONES}
        console.print(predicted.judged(took, curve.steps[-1]), soft_wrap=True, markup=False)
    if (share := trainer.metrics().get("meta_illegal_goals", 0.0)) > MANY_ILLEGAL:
        warn(f"{share:.0%} of the goals given in the episodes under way were not legal, and counted as no goal")
    kind, film, options = _film(trainer, folder)
    for what, text in {
        "learning curve": picture,
        f"one {kind}": film,
        "watch it": shell_words("python", "-m", "hierroom", "watch", *run, *options),
        "evaluate it": shell_words("python", "-m", "hierroom", "evaluate", *run),
    }.items():
        console.print(f"{what:<15} {text}", soft_wrap=True, markup=False)


def telling_episode(agent: TrainedAgent, seed: int) -> Episode:
    """Return the first episode in which an agent succeeds; if it never does, or has no target, the first episode."""
    played = list(rollout(agent, None, N_PICTURED, num_envs=N_PICTURED, seed=seed, progress=lambda done: None))
    return next((episode for episode in played if episode.success), played[0])


def _film(trainer: Trainer, folder: RunFolder) -> tuple[str, str, tuple[str, ...]]:
    """Write the film of an episode, or only warn if the user's environment cannot be drawn; delete older films.

    Return the kind of the episode, what to print of its film, and options of watch that show such an episode.
    """
    kind, film, options, path = "episode", "none, as film is False", (), None
    if trainer.config.film is not False:
        agent = TrainedAgent(trainer.config, trainer.agents[META], trainer.controller, trainer.steps, path=folder.path)
        episode = telling_episode(agent, (trainer.config.seed + 1) % 2**63)
        kind = good = "escape" if trainer.config.env.task is None else "success"
        none = ""
        if episode.success is None:
            kind = "episode"
        elif not episode.success:
            kind, none, options = "failure", f" (no {good} in {N_PICTURED} episodes)", ("--failures",)
        path = folder.path / f"{kind}.gif"
        try:
            save_episodes([episode], path)
        except InputError as error:
            warn(f"there is no film of an episode: {error}")
            path = None
        film = f"{path or 'none'}{none}"
    for old in (folder.path / name for name in FILMS):
        if old != path:
            delete(old)
    return kind, film, options


def _table(curve: LearningCurve | None, summary: dict[str, Any]) -> Table:
    rows = {}
    if curve is not None:
        name, number = outcome_in_words(*curve.last, digits=1)
        rows[f"{name}, evaluated over {curve.episodes[-1]:.0f} episodes"] = number
        rows["episode length, evaluated"] = f"{curve.length[-1]:.1f}"
    n_last = min(WINDOW, summary["episodes"])
    trained = (summary.get(f"training_{name}", math.nan) for name in ("success_rate", "episode_return", "score"))
    name, number = outcome_in_words(*trained, digits=1)
    rows[f"{name}, last {n_last} episodes of training"] = number
    rows["steps"] = f"{summary['steps']:,}"
    if curve is not None and not curve.is_rate:
        best = int(curve.returns.argmax())
        rows[f"best return, evaluated after {curve.steps[best]:,.0f} steps"] = f"{curve.returns[best]:.5g}"
    name = "" if curve is None or not curve.is_rate else curve.outcome_name.removesuffix("_rate")
    for milestone in MILESTONES if name else ():
        steps = summary[f"steps_to_{milestone}"]
        rows[f"steps to {milestone}% {name}, evaluated"] = "-" if steps is None else f"{steps:,.0f}"
    if "stage" in summary:
        rows["stage of the curriculum"] = f"{summary['stage']} of {summary['stages']}"
    rows["seconds of training"] = f"{summary['seconds']:.1f}"
    rows["steps per second"] = f"{summary['steps_per_second']:,.0f}"
    rows["memory of the rollout"] = f"{summary['rollout_bytes'] / 2**20:.1f} MiB"
    table = Table("", Column(justify="right"), show_header=False)
    for row in rows.items():
        table.add_row(*row)
    return table


def plot_learning_curve(run: RunFolder, curve: LearningCurve | None, path: Path) -> None:
    """Plot success rate (or return) and episode length over the steps trained; ``curve`` has the evaluations."""
    from matplotlib.figure import Figure  # imported here, because it loads slowly

    rows = run.metrics.numbers()
    unit, name = step_unit(max((row["steps"] for row in rows), default=0))
    steps = [row["steps"] / unit for row in rows]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    panels = figure.subplots(1, 2)
    has_target = not any(math.isnan(row["success_rate"]) for row in rows)
    is_score = bool(rows) and "score" in rows[0]
    column = "score" if is_score else "success_rate" if has_target else "episode_return"
    scale = 1 if column == "episode_return" else 100
    windows = [scale * row[column] for row in rows], [row["episode_length"] for row in rows]
    evaluated = None if curve is None else (scale * curve.outcome, curve.length)
    for n, axes in enumerate(panels):
        axes.plot(steps, windows[n], color="tab:orange", linewidth=1, label=f"training, last {WINDOW} episodes")
        if curve is not None and evaluated is not None:
            axes.plot(curve.steps / unit, evaluated[n], color="tab:blue", marker="o", markersize=3, label="evaluated")
        axes.set_xlabel(f"primitive steps ({name})")
        axes.grid(alpha=0.3)
    if scale == 100:
        texts = ("score (%)", "geometric mean of the goals") if is_score else ("success (%)", "reached the target")
        panels[0].set(ylim=(-2, 102), ylabel=texts[0], title=texts[1])
    else:
        panels[0].set(ylabel="return", title="return of an episode")
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
