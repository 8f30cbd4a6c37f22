"""The measures that are compared: those that predict, and others."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hierroom.lab.advise.measures import MEASURES, Known


def e_markings(known: Known) -> float:
    """Return E x markings: random steps to the target, times the situations that the rules tell apart."""
    return known.expected_steps * known.markings


def e_fewest(known: Known) -> float:
    """Return E x fewest: random steps to the target, times the goals that a solution needs."""
    return known.expected_steps * known.fewest


CANDIDATES: Mapping[str, Callable[[Known], float]] = {
    **MEASURES,
    "costs x kinds": lambda known: known.cost * known.kinds,
    "E x markings": e_markings,
    "E x fewest": e_fewest,
    "E": lambda known: known.expected_steps,
}
