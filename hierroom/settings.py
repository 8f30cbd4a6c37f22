"""What an environment is made of, in one place for every face of it."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from pathlib import Path

from hierroom.complexity import ComplexityReport, analyze
from hierroom.controller import NOVELTY_BONUS
from hierroom.goals import GoalGraph, as_goal_graph
from hierroom.turns import Turns
from hierroom.world.batch import Batch

FRAMES_PER_SECOND = 10


@dataclass(frozen=True)
class RoomSettings:
    """The arguments shared by `env`, `parallel_env` and the Gymnasium environments.

    Args:
        graph: a letter ``"a"`` to ``"g"``, a `GoalGraph`, or a path to a TOML file that describes one.
        size: cells of the grid's side, 11 to 63, outer walls included.
        max_steps: primitive steps after which an episode is truncated.
        drop_key: whether the controller has a sixth action that drops a key.
        pay: how the controller is paid: ``extrinsic``, ``bonus``, ``intrinsic`` or ``novelty``.
        subgoal_horizon: primitive steps after which a goal's life ends unreached, or None for never.
        goal_mask: which goals are legal: ``reachable``, ``existing``, ``seen`` or ``none``.
        room_index: the number of the (first) room; with the seed it fixes the episodes.
        novelty_bonus: what ``novelty`` pays for each state entered first in an episode; the exit pays 1.
    """

    graph: GoalGraph | str | Path = "c"
    size: int = 19
    max_steps: int = 1000
    drop_key: bool = False
    pay: str = "intrinsic"
    subgoal_horizon: int | None = None
    goal_mask: str = "reachable"
    room_index: int = 0
    novelty_bonus: float = NOVELTY_BONUS

    def turns(self, batch_size: int = 1, *, autoreset: bool = False, threads: int = 1) -> Turns:
        """Rooms and the turns taken in them, with the shortest length of each episode measured."""
        world = Batch(
            [self.goal_graph],
            batch_size,
            size=self.size,
            max_steps=self.max_steps,
            drop_key=self.drop_key,
            first_index=self.room_index,
            threads=threads,
        )
        return Turns(
            world,
            pay=self.pay,
            novelty_bonus=self.novelty_bonus,
            subgoal_horizon=self.subgoal_horizon,
            goal_mask=self.goal_mask,
            autoreset=autoreset,
            measure_shortest=True,
        )

    @property
    def goal_graph(self) -> GoalGraph:
        """The goal graph that ``graph`` means."""
        return as_goal_graph(self.graph)

    def complexity(self) -> ComplexityReport:
        """How hard the rooms are to explore."""
        return analyze(self.goal_graph, drop_key=self.drop_key)


def fresh_seed() -> int:
    """A seed nobody chose."""
    return secrets.randbits(63)
