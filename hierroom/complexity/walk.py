"""The random walk of the paper's appendix, and the readings of its augmented graph, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hierroom.errors import InputError


@dataclass(frozen=True)
class Walk:
    """What one step of the walk does (paper, appendix A); the three chances sum to one.

    Args:
        stay: chance that no transition happens.
        move: chance to follow an outgoing edge, split evenly over a node's edges.
        restart: chance to return to the start node, from every node but the start itself, which stays instead.

    Raises:
        InputError: if a chance is negative or not finite, or the three do not sum to one.
    """

    stay: float = 0.80
    move: float = 0.19
    restart: float = 0.01

    def __post_init__(self) -> None:
        chances = (self.stay, self.move, self.restart)
        if not all(math.isfinite(chance) and chance >= 0 for chance in chances):
            raise InputError(f"the walk's chances stay, move, restart must lie in 0..1, not {chances}")
        if not math.isclose(sum(chances), 1.0, abs_tol=1e-9):
            raise InputError(f"the walk's chances stay, move, restart must sum to 1, not {sum(chances):g}")


KEY_SIGHTS = ("accessible", "way to the start", "own room")
ROOM_MOVES = ("accessible", "neighbours", "through the start")
DROP_RETURNS = ("accessible", "key room", "start")


@dataclass(frozen=True)
class Reading:
    """One reading of the paper's augmented graph; the default is the one that reproduces Table 2 for a, b, c, g.

    Args:
        keys: from which rooms a key can be picked up: from every `"accessible"` room, from those whose
            `"way to the start"` in the tree of keys passes the key's room, or from its `"own room"`.
        rooms: where a room leads: to every other `"accessible"` room, to its `"neighbours"` in the tree of keys (as
            the appendix draws graph c), or `"through the start"` room only (as the level is built).
        drop: where dropping a key leads: to every `"accessible"` room, to the `"key room"`, or to the `"start"` room.

    Raises:
        InputError: if a choice is not one of those named.
    """

    keys: str = "accessible"
    rooms: str = "accessible"
    drop: str = "accessible"

    def __post_init__(self) -> None:
        for field, allowed in (("keys", KEY_SIGHTS), ("rooms", ROOM_MOVES), ("drop", DROP_RETURNS)):
            if getattr(self, field) not in allowed:
                raise InputError(
                    f"the reading of {field} is one of {', '.join(map(repr, allowed))}, not {getattr(self, field)!r}"
                )


PAPER_WALK = Walk()
TABLE_READING = Reading()
