"""What an environment is made of: one description for every API, for training and for evaluation.

It is data alone, and loads neither the world nor torch, so that a command can explain itself at once.
"""

from __future__ import annotations

import inspect
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, ParamSpec, TypeVar

import tyro

from hierroom.errors import InputError
from hierroom.goals import GoalGraph

RewardName = Literal["extrinsic", "bonus", "intrinsic", "novelty"]
GoalMaskName = Literal["reachable", "existing", "seen", "none"]

NOVELTY_BONUS = 0.03
"""Size of the bonus for a novel state unless another is given. Leaving at once is certain to be worth more than the
states that are left up to (1 - gamma) / gamma, 0.053 at the default discount."""
FRAMES_PER_SECOND = 10
P = ParamSpec("P")
T = TypeVar("T")
_GRAPH = tyro.constructors.PrimitiveConstructorSpec(
    nargs=1,
    metavar="GRAPH",
    instance_from_str=lambda words: words[0],
    is_instance=lambda _: True,
    str_from_instance=lambda graph: [str(graph)],
)
"""How a graph is given on the command line: as a text, which `as_goal_graph` or `parse_difficulty` reads."""


@dataclass(frozen=True)
class EnvConfig:
    """What an environment is made of.

    Args:
        graph: the goal graph: a letter from a to g, a path to a .toml file, or for all graphs in between
            hitting_time:LOW..HIGH or expected_steps:LOW..HIGH.
        curriculum_stages: parts into which such an interval is cut; one moves on after escaping in 80% of 200
            episodes, and back below 20%. 1: all its graphs at once.
        size: cells of the grid's side, 11 to 63, outer walls included.
        max_steps: primitive steps after which an episode is truncated.
        drop_key: give the controller a sixth action that drops a key.
        reward: the controller's reward: extrinsic (1 at the exit), bonus (1 for each key, door and the exit),
            intrinsic (1 where its goal is reached) or novelty (1 at the exit, and the novelty bonus). None: that of
            the method in training, else intrinsic.
        novelty_bonus: the reward novelty gives for each state entered for the first time in an episode; the exit
            gives 1.
        subgoal_horizon: primitive steps after which an option ends without its goal; None: never.
        goal_mask: goals the meta-controller may choose: reachable, existing, seen (or no goal: find something new)
            or none (all there could be).
        env_index: the index of the (first) environment; with the seed it fixes the episodes.
    """

    graph: Annotated[GoalGraph | str | Path, _GRAPH] = "c"
    curriculum_stages: int = 1
    size: int = 19
    max_steps: int = 1000
    drop_key: bool = False
    reward: RewardName | None = None
    novelty_bonus: float = NOVELTY_BONUS
    subgoal_horizon: int | None = None
    goal_mask: GoalMaskName = "reachable"
    env_index: Annotated[int, tyro.conf.Suppress] = 0

    @classmethod
    def of_arguments(cls, arguments: Mapping[str, Any]) -> EnvConfig:
        """The config that an environment's arguments describe; those that are none of its entries are passed over."""
        return cls(**{field.name: arguments[field.name] for field in fields(cls)})

    @property
    def n_actions(self) -> int:
        """The controller's number of actions."""
        return 6 if self.drop_key else 5


def fresh_seed() -> int:
    """A seed nobody chose."""
    return secrets.randbits(63)


def known_arguments(function: Callable[P, T]) -> Callable[P, T]:
    """The function, with one clear line for a keyword that it does not take.

    Raises:
        InputError: from the function, if it is given an unknown keyword.
    """
    known = [name for name in inspect.signature(function).parameters if name != "self"]

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> T:
        unknown = [name for name in kwargs if name not in known]
        if unknown:
            raise InputError(f"an environment takes {', '.join(known)}; not {', '.join(unknown)}")
        return function(*args, **kwargs)

    return checked
