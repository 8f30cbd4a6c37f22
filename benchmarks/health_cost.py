"""Cost of the checks of `learners.health`: whole updates with and without them, in turn, and the checks alone.

    python -m benchmarks.health_cost --pairs 300

In one training, one of each two updates is checked, in an order drawn for each pair. So both see the same levels, the
same network and the same load of the machine. Times are CPU time of its one thread. The cost is the median over the
pairs of time with checks by time without, with an interval from resampling the pairs. The next column is the share of
the time in checked updates that the checks take.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any
from unittest import mock

import numpy as np
import torch
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from hierroom.learners import ppo
from hierroom.runs.config.presets import find_preset
from hierroom.runs.trainer import Trainer

WARM_UP, RESAMPLES = 5, 2000


@dataclass(frozen=True)
class Options:
    """Measure what checking a learner's numbers costs.

    Args:
        pairs: of updates, one of each with the checks.
        presets: what is trained.
        seed: fixes the order in each pair.
    """

    pairs: int = 300
    presets: tuple[str, ...] = ("default", "long", "learned")
    seed: int = 0


def advance(trainer: Trainer, is_checked: bool) -> tuple[float, float]:
    """Take an update; returns its CPU seconds, and those of them in the checks."""
    spent = [0.0]

    def timed(check: Callable[..., None], *arguments: Any) -> None:
        started = time.thread_time()
        check(*arguments)
        spent[0] += time.thread_time() - started

    def left_out(*_: Any) -> None:
        pass

    checks = {name: getattr(ppo, name) for name in ("check_batch", "check_update")}
    instead = {name: partial(timed, check) if is_checked else left_out for name, check in checks.items()}
    with mock.patch.multiple(ppo, **instead):
        started = time.thread_time()
        trainer.advance()
        return time.thread_time() - started, spent[0]


def main() -> None:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    torch.set_num_threads(1)
    rng = np.random.default_rng(options.seed)
    table = Table("preset", "pairs", "update [ms]", "cost", "95% interval", "in the checks")
    for preset in options.presets:
        trainer = Trainer(find_preset(preset).changed(steps=10**12, threads=1))
        for _ in range(WARM_UP):
            advance(trainer, True)
        pairs, inside = np.empty((options.pairs, 2)), np.empty(options.pairs)
        for n in track(range(options.pairs), f"{preset:<8}"):
            for is_checked in rng.permutation(2).tolist():
                pairs[n, is_checked], spent = advance(trainer, bool(is_checked))
                if is_checked:
                    inside[n] = spent
        ratios = pairs[:, 1] / pairs[:, 0] - 1
        resampled = np.median(rng.choice(ratios, (RESAMPLES, len(ratios))), axis=1)
        low, high = np.quantile(resampled, (0.025, 0.975))
        table.add_row(
            preset,
            str(options.pairs),
            f"{1000 * np.median(pairs[:, 1]):.1f}",
            f"{np.median(ratios):+.2%}",
            f"{low:+.2%} to {high:+.2%}",
            f"{inside.sum() / pairs[:, 1].sum():.2%}",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
