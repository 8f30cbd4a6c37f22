"""The rule that says what was measured: where no prediction is made, and where only the wide interval is.

The rule was written before the model was fitted (2026-11-28); the limit of workshops was corrected to that of their
runs afterwards. A task lies outside if one of these is true of it:

1. random play never reached the target, or a goal on the way to it;
2. E, its mean random steps to the target, is less than half of the smallest or more than twice the largest of the rows
   that fit the model;
3. it has more than twice as many goals as the largest of these;
4. its episodes are shorter than half of the shortest, or longer than twice the longest of these;
5. the measure that predicts cannot be computed, as its rules are unknown or have too many markings;
6. random play reaches the target in more than half of its episodes, as in none of these (added after a task with 57%,
   of which HiPPO had learned 50% at its first evaluation).

Everything else is predicted. A world is `same` if its rows fit the model: EscapeRooms with grids of 19 cells that are
drawn, one goal graph, no drop and the usual limit, and workshops drawn by number with the limit of the runs, 400. All
others are `other` worlds, whose intervals are those of a whole world left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from hierroom.lab.advise.measures import Known
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, EnvConfig

FACTOR = 2
MOST_RANDOM_SUCCESS = 0.5
OTHER = "other"
WORKSHOP_LIMIT = 400
"""Steps of an episode in the workshops of the runs."""


def world_of(config: EnvConfig) -> str:
    """Return the world of the model's rows that a config belongs to, else `OTHER`."""
    if config.task is not None:
        is_drawn = isinstance(config.task, str) and re.fullmatch(r"workshop:\d+(:\d+)?(:\w+)?", config.task)
        return "workshop" if is_drawn and config.max_steps == WORKSHOP_LIMIT else OTHER
    is_usual = config.size == 19 and config.max_steps == DEFAULT_MAX_STEPS and not config.drop_key and not config.layout
    return "escape_room" if is_usual and len(config.names) == 1 else OTHER


def outside(known: Known, value: float, bounds: Mapping[str, tuple[float, float]]) -> str | None:
    """Return why a task lies outside of what was measured, or None.

    Args:
        known: what play and rules showed of it.
        value: the measure that predicts.
        bounds: the smallest and the largest of ``expected_steps``, ``goals`` and ``limit`` among the model's rows.
    """
    if not math.isfinite(known.expected_steps) or not math.isfinite(known.cost):
        return "random play did not reach the target, or not often enough"
    words = {"expected_steps": "random steps to the target", "limit": "steps of an episode"}
    for name, what in words.items():
        low, high, found = bounds[name][0] / FACTOR, bounds[name][1] * FACTOR, getattr(known, name)
        if not low <= found <= high:
            return f"{what}: {found:,.0f}, where {low:,.0f} to {high:,.0f} were measured"
    if known.random_success > MOST_RANDOM_SUCCESS:
        return f"random play succeeds in {known.random_success:.0%} of the episodes, where at most half were measured"
    if known.goals > (most := FACTOR * bounds["goals"][1]):
        return f"{known.goals} goals, where at most {most:,.0f} were measured"
    return None if math.isfinite(value) and value > 0 else "its rules are unknown, or have too many markings to count"
