"""The random walk of the paper's appendix, and the possible readings of its augmented graph."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hierroom.support.errors import InputError, require_number


@dataclass(frozen=True)
class Walk:
    """The probabilities of one step of the walk (paper, appendix A); they sum to one.

    Args:
        stay: probability that no transition happens.
        move: probability to follow an outgoing edge, divided evenly among a node's edges.
        restart: probability to return to the start node, from every node except the start, which stays instead.
    """

    stay: float = 0.80
    move: float = 0.19
    restart: float = 0.01

    def __post_init__(self) -> None:
        chances = (self.stay, self.move, self.restart)
        for name, chance in zip(("stay", "move", "restart"), chances, strict=True):
            require_number(f"the probability {name} of a walk", chance, 0, 1)
        if not math.isclose(sum(chances), 1.0, abs_tol=1e-9):
            raise InputError(f"the probabilities stay, move, restart of a walk must sum to 1, not {sum(chances):g}")


READINGS = {
    "keys": ("accessible", "way to the start", "own room"),
    "rooms": ("accessible", "neighbours", "through the start"),
    "drop": ("accessible", "key room", "start"),
}


@dataclass(frozen=True)
class Reading:
    """One interpretation of the paper's augmented graph; the default reproduces Table 2 for a, b, c and g.

    Args:
        keys: the rooms from which a key can be picked up: every `"accessible"` room, those with the key's room on their
            `"way to the start"` in the tree of keys, or only the key's `"own room"`.
        rooms: the rooms to which a room leads: every other `"accessible"` room, its `"neighbours"` in the tree of keys
            (as the appendix draws graph c), or, as levels are built, only `"through the start"`.
        drop: where dropping a key leads: to every `"accessible"` room, the `"key room"`, or the `"start"` room.
    """

    keys: str = "accessible"
    rooms: str = "accessible"
    drop: str = "accessible"

    def __post_init__(self) -> None:
        for field, allowed in READINGS.items():
            if getattr(self, field) not in allowed:
                raise InputError(
                    f"{field} of a reading must be one of {', '.join(map(repr, allowed))}, not {getattr(self, field)!r}"
                )


PAPER_WALK = Walk()
TABLE_READING = Reading()
