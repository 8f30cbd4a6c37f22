"""Find which of two methods is first to a milestone, and which of their runs get there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.study.paired import Paired
from benchmarks.study.trained import medians


@dataclass(frozen=True)
class Lead:
    """Lead of one of two methods over the other.

    Args:
        first: on how many graphs its median steps are fewer than the other's.
        with_every_seed: on how many graphs each of its seeds is there before each seed of the other.
        reached: on how many graphs each of its seeds gets there.
        runs_reached: how many of its runs get there.
        runs: how many runs it has.
    """

    first: int
    with_every_seed: int
    reached: int
    runs_reached: int
    runs: int


def leads(found: Paired) -> tuple[Lead, Lead]:
    """Return the lead of each of two methods over the other, over all goal graphs.

    Args:
        found: the two methods.
    """
    first, second = found.steps
    return _lead(first, second), _lead(second, first)


def sentence(found: Paired, names: tuple[str, str]) -> str:
    """Return the same in three sentences.

    Args:
        found: the two methods.
        names: of the two, in the same order.
    """
    found_leads = [*zip(names, leads(found), strict=True)]
    milestone = found.outcome.removeprefix("steps_to_")
    first = ", ".join(f"{name} on {one.first}" for name, one in found_leads)
    every = ", ".join(f"{name} on {one.with_every_seed}" for name, one in found_leads)
    reached = ", ".join(f"{name} on {one.reached} ({one.runs_reached} of {one.runs} runs)" for name, one in found_leads)
    return (
        f"Fewer median steps to {milestone}%, of {len(found.graphs)} goal graphs: {first}. "
        f"Every seed is before every seed of the other method: {every}. Every seed gets to {milestone}%: {reached}."
    )


def _lead(own: NDArray[np.float64], other: NDArray[np.float64]) -> Lead:
    """Of the steps of a method and those of the other, each [G, S] as `Paired` has them."""
    missing = np.isnan(own)
    return Lead(
        first=int((medians(own) < medians(other)).sum()),
        with_every_seed=int((np.nanmax(own, axis=1) < np.nanmin(other, axis=1)).sum()),
        reached=int((np.isfinite(own) | missing).all(axis=1).sum()),
        runs_reached=int(np.isfinite(own).sum()),
        runs=int((~missing).sum()),
    )
