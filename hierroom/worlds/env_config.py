"""The config of an environment; loads neither the world nor torch, so that ``--help`` is fast."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal, get_args

import tyro
from msgspec import Meta

from hierroom.goals import GraphSpecs, graph_specs, spec_names
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.support.typed_value import check_entries
from hierroom.worlds.escape_room.level_map import as_maps

RewardName = Literal["extrinsic", "bonus", "intrinsic", "novelty"]
GoalMaskName = Literal["reachable", "existing", "seen", "none"]
LevelsName = Literal["training", "evaluation"]
SPLITS: Mapping[str | None, int] = {name: n for n, name in enumerate((None, *get_args(LevelsName)))}
"""Numbers of the sets of levels to draw from; training and evaluation levels have no layout in common."""

NOVELTY_BONUS = 0.03
"""Default bonus for a novel state. Up to (1 - gamma) / gamma, 0.053 at the default discount, leaving immediately is
certain to be worth more than visiting the remaining states first."""
_Count = Annotated[int, Meta(ge=1, le=2**62 - 1)]
FRAMES_PER_SECOND = 10


def _several(metavar: str, names_of: Callable[[Any], Iterable[str]]) -> tyro.constructors.PrimitiveConstructorSpec:
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs="*",
        metavar=f"{metavar} [{metavar} ...]",
        instance_from_str=tuple,
        is_instance=lambda _: True,
        str_from_instance=lambda given: [*names_of(given)] or ["none"],  # for help texts only
    )


GRAPHS = _several("GRAPH", spec_names)
"""Graphs on the command line: texts that `hierroom.complexity.GraphSet` reads."""
LAYOUTS = _several("FILE", lambda maps: map(str, maps))
"""Layouts on the command line: paths."""


def _named(metavar: str) -> tyro.constructors.PrimitiveConstructorSpec:
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda words: None if words[0] == "None" else words[0],
        is_instance=lambda _: True,
        str_from_instance=lambda thing: [str(thing)],
    )


DEFAULT_MAX_STEPS = 1000
MOST_ENVS = 2**20
"""Most environments of a world."""
SHIPPED: Mapping[str, str] = {"workshop": "hierroom.worlds.workshop.task:workshop_of"}
"""Makers of the built-in worlds, by the word before the colon of their name.

For ``workshop:8`` the function ``workshop_of`` is called with the text ``8``.
"""
OF_DRAWN = ("graph", "exclude", "curriculum_stages", "size")
"""Entries for drawn levels; a layout replaces them."""
OF_ESCAPE_ROOMS = (*OF_DRAWN, "drop_key", "layout")
"""Entries that apply to EscapeRooms only; the others apply to every world."""


@dataclass(frozen=True)
class EnvConfig:
    """Describe an environment.

    Args:
        graph: one goal graph or several; each episode samples one. Letters from a to g, names such as
            keys-0-1-exit-2 (the room of each key, and of the exit), or paths to .toml files. rooms:N means every graph
            of N rooms; hitting_time:LOW..HIGH and expected_steps:LOW..HIGH mean all graphs in this range.
        exclude: goal graphs to leave out, in the same forms; they may have any number of rooms.
        curriculum_stages: stages of equal width in difficulty, the easiest graphs first. Training advances after
            escapes in 80% of at least 200 episodes (equally many per environment), and goes back below 20%. 1: no
            stages.
        size: cells of the grid's side, 11 to 63, outer walls included.
        max_steps: primitive steps after which an episode is truncated. None: 1000, or the task's own limit.
        drop_key: give the controller a sixth action that drops a key.
        reward: the controller's reward: extrinsic (the environment's own: 1 at the target, such as the exit), bonus (1
            when a goal, such as a key or door, is first achieved in an episode), intrinsic (1 when its goal is reached)
            or novelty (extrinsic plus novelty_bonus). Or your own: package.module:Class or package.module:function.
            None: the method's reward in training, else intrinsic, or extrinsic in a task without goals.
        novelty_bonus: what the reward novelty adds for each state entered for the first time in an episode.
        subgoal_horizon: primitive steps after which an option ends without its goal; None: never.
        goal_mask: goals that the meta-controller may choose: reachable (by the goal graph or rules), existing (left to
            achieve), seen (in EscapeRooms; or no goal: find something new) or none (all goals, even absent ones).
        task: another world than EscapeRooms, so that graph, exclude, curriculum_stages, size and drop_key do not apply:
            package.module:name of a `hierroom.Task`, or a built-in world, such as workshop:8. A
            workshop's name determines its tech tree: workshop:8 is workshop:8:0, and workshop:8:3 is the tree of seed
            3. The run's seed determines the rest.
        layout: your own levels instead of graph, exclude, curriculum_stages and size: the path of a text map (in Python
            also its text), or several; each episode draws one. In a map # is wall, space or . is floor, @ the start,
            drawn as > v < ^ with a direction, and E the exit. R G B P Y W are locked doors (red, green, blue, purple,
            yellow, grey), r g b p y w their keys. Keys and doors must form a tree.
        env_index: index of the (first) environment; seed and index determine the episodes.
        levels: training or evaluation levels, which share no layout. None: all levels. Training and evaluation set it.

    Examples:
        >>> config = hierroom.EnvConfig("g", size=11, reward="bonus")
        >>> config.changed(graph=["a", "b"]).names
        ('a', 'b')
    """

    graph: Annotated[GraphSpecs, GRAPHS] = "c"
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    curriculum_stages: _Count = 1
    size: int = 19
    max_steps: _Count | None = None
    drop_key: bool = False
    reward: Annotated[Any, _named("REWARD")] = None
    novelty_bonus: Annotated[float, Meta(ge=0, le=10**6)] = NOVELTY_BONUS
    subgoal_horizon: _Count | None = None
    goal_mask: GoalMaskName = "reachable"
    task: Annotated[Any, _named("TASK")] = None
    layout: Annotated[Any, LAYOUTS] = ()
    env_index: Annotated[int, Meta(ge=0, le=2**62 - 1), tyro.conf.Suppress] = 0
    levels: Annotated[LevelsName | None, tyro.conf.Suppress] = None

    def __post_init__(self) -> None:
        check_entries(self)
        specs = graph_specs(self.graph)
        object.__setattr__(self, "graph", specs[0] if len(specs) == 1 else specs)
        object.__setattr__(self, "exclude", graph_specs(self.exclude))
        layout = as_maps(() if self.layout is None else self.layout)
        object.__setattr__(self, "layout", layout)
        if self.task is None:
            object.__setattr__(self, "max_steps", DEFAULT_MAX_STEPS if self.max_steps is None else self.max_steps)
        elif not (self.task if isinstance(self.task, str) else is_task(self.task)):
            raise InputError(f"a task is a name, like package.module:name, or a hierroom.Task, not {shown(self.task)}")
        size = max((one.size for one in layout), default=None) if self.task is None else None
        changed = [entry.name for entry in fields(EnvConfig) if getattr(self, entry.name) != entry.default]
        self.refuse_unread([name for name in changed if (name, self.size) != ("size", size)])
        if size is not None:
            object.__setattr__(self, "size", size)

    def refuse_unread(self, names: Collection[str]) -> None:
        """Refuse entries, by name, that the user has given and that the task or layout ignores."""
        if self.task is not None and (unread := [name for name in OF_ESCAPE_ROOMS if name in names]):
            raise InputError(f"{unread[0]} is for EscapeRooms; {task_name(self.task)} has no such entry")
        if self.layout and (unread := [name for name in OF_DRAWN if name in names]):
            raise InputError(f"{unread[0]} is for levels that are drawn; the layout {self.names[0]} is fixed")

    def changed(self, **entries: Any) -> EnvConfig:
        """Return the config with some entries changed.

        A new layout replaces goal graphs and vice versa. A task instead of EscapeRooms replaces both, and their default
        of ``max_steps``.
        """
        rooms = {entry.name: entry.default for entry in fields(EnvConfig) if entry.name in OF_ESCAPE_ROOMS}
        drawn = {name: rooms[name] for name in OF_DRAWN}
        if self.task is None and entries.get("task") is not None:
            limit = None if self.max_steps == DEFAULT_MAX_STEPS else self.max_steps
            entries = {**rooms, "max_steps": limit, **entries}
        elif entries.get("layout"):
            entries = drawn | entries
        elif self.layout and ("graph" in entries or "layout" in entries):
            entries = {"layout": (), "size": drawn["size"]} | entries
        return replace(self, **entries)

    @classmethod
    def of_arguments(
        cls, entries: Mapping[str, Any], others: Sequence[str] = (), *, has_goals: bool = True
    ) -> EnvConfig:
        """Return the config that keyword arguments describe, and warn of those without effect.

        A task given as ``graph`` becomes the task.

        Args:
            entries: the arguments.
            others: names of other allowed arguments, for error messages.
            has_goals: whether somebody chooses goals.
        """
        if is_task(entries.get("graph")):
            if entries.get("task", entries["graph"]) != entries["graph"]:
                raise InputError("graph and task are two tasks; for a task of your own use hierroom/Task-v0")
            entries = {"task": entries["graph"], **{name: one for name, one in entries.items() if name != "graph"}}
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in entries if name not in known]:
            raise InputError(f"an environment takes {', '.join((*known, *others))}; not {', '.join(unknown)}")
        config = cls(**entries)
        unread = (
            {}
            if config.reward == "novelty"
            else {"novelty_bonus": f"with the reward {shown(config.reward or 'intrinsic')}"}
        )
        unread |= {} if has_goals else dict.fromkeys(("subgoal_horizon", "goal_mask"), "without a meta-controller")
        for name, why in unread.items():
            if name in entries and entries[name] != getattr(cls, name):
                warn_once(f"{name} has no effect {why}")
        return config

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the task, of the layouts, or of the goal graphs."""
        if self.task is not None:
            return (task_name(self.task),)
        return tuple(one.name for one in self.layout) or tuple(spec_names(self.graph))

    @property
    def unusual(self) -> dict[str, Any]:
        """The entries that set its episodes apart from the usual ones of that name, such as ``{"size": 25}``."""
        usual = {"exclude": (), "curriculum_stages": 1, "size": EnvConfig.size, "drop_key": False}
        usual["max_steps"] = DEFAULT_MAX_STEPS if self.task is None else None
        return {name: own for name, one in usual.items() if (own := getattr(self, name)) != one}

    @property
    def key(self) -> str:
        """The names and the `unusual` entries: what advice and its runs have in common."""
        return " ".join([",".join(self.names), *(f"{name}={value}" for name, value in self.unusual.items())])

    @property
    def kind(self) -> str:
        """Kind of the names: ``task``, ``layout`` or ``graph``."""
        return "task" if self.task is not None else "layout" if self.layout else "graph"


def is_task(thing: object) -> bool:
    """Return whether an object is a task (not a task's name): see `make.WorldMaker`."""
    return hasattr(thing, "make_world")


def task_name(task: Any) -> str:
    """Return a task's name: the text that was typed, or the task's own name."""
    return task if isinstance(task, str) else task.name


def fresh_seed() -> int:
    """Return a random seed."""
    return secrets.randbits(63)


def ships(spec: Any) -> bool:
    """Return whether it is the name of a built-in task."""
    return isinstance(spec, str) and spec.partition(":")[0] in SHIPPED
