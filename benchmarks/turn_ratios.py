"""Ratios of the learned meta-controller's turns before the first gradient step of an update, which PPO takes to be 1.

    python -m benchmarks.turn_ratios --updates 60

Few turns of a meta-controller are due at a time, so that its sequences span updates. A turn's ratio is its action's
probability under the weights that learn from it, divided by a reference. That is the probability under the weights that
took it (as collected) or the learner's replacement (as learned from).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress

from benchmarks.result_table import ResultTable
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.learners.ppo import Learner
from hierroom.learners.rollout import Batch
from hierroom.learners.sampling import log_probabilities
from hierroom.runs.config.presets import find_preset
from hierroom.runs.trainer import Trainer
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.turns.records import META


@dataclass(frozen=True)
class Options:
    """Measure the ratios of a learned meta-controller's turns.

    Args:
        graph: on which both agents are trained.
        updates: of the meta-controller, from the first on.
        seed: of the training.
        out: a file that the table is written to as CSV.
    """

    graph: str = "c"
    updates: int = 60
    seed: int = 0
    out: Path | None = None


def log_probs_now(learner: Learner, batch: Batch) -> NDArray[np.floating]:
    """Return log-probabilities [T, M] of a batch's actions under the current weights, from the stored states."""
    with torch.no_grad():
        logits, _ = learner.network.sequence(  # pyright: ignore[reportCallIssue] - a PolicyNetwork has it
            *map(torch.from_numpy, (batch.features, batch.initial_states, batch.resets))
        )
    flat = logits.numpy().reshape(-1, logits.shape[-1]), batch.masks.reshape(-1, logits.shape[-1])
    return log_probabilities(*flat, batch.actions.ravel()).reshape(batch.actions.shape)


def main() -> None:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    if options.updates < 1:
        raise InputError(f"updates must be at least 1, not {options.updates}")
    trainer = Trainer(find_preset("learned").changed(graph=options.graph, seed=options.seed))
    agent = trainer.agents[META]
    assert isinstance(agent, PPOAgent)
    learner, renew = agent.learner, agent.learner._renewed
    collected, learned = [], []

    def watched(batch: Batch) -> tuple[Batch, NDArray[np.float32]]:
        renewed = renew(batch)
        now = log_probs_now(learner, batch)
        collected.append(np.exp(now - batch.log_probs).ravel())
        learned.append(np.exp(now - renewed[0].log_probs).ravel())
        return renewed

    learner._renewed = watched
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("updates of the meta-controller", total=options.updates)
        while len(learned) < options.updates:
            trainer.advance()
            progress.update(task, completed=len(learned))
    headings = "turns", "more than 0.01 from 1", "outside the clip range", "greatest", "farthest from 1"
    rows, clip = [], learner.config.clip
    for name, ratios in ("as collected", np.concatenate(collected)), ("as learned from", np.concatenate(learned)):
        off = abs(ratios - 1)
        shares = (f"{(off > limit).mean():.1%}" for limit in (0.01, clip))
        rows.append((name, f"{len(ratios):,}", *shares, f"{ratios.max():.1f}", f"{off.max():.2g}"))
    ResultTable(("ratios", *headings), tuple(rows)).publish(options.out)


if __name__ == "__main__":
    run(main)
