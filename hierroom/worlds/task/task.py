"""A task: a user's own Gymnasium environment, its goals and their dependencies."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from hierroom.complexity.requirements import goal_depths
from hierroom.goals.alternatives import Alternative, read_name
from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules
from hierroom.support.errors import InputError, require_number, shown, user_code
from hierroom.worlds.actions import Actions
from hierroom.worlds.base_view import goal_status
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, EnvConfig
from hierroom.worlds.task.goal_values import GoalFunction
from hierroom.worlds.task.parts import TaskParts, Trial
from hierroom.worlds.task.replayer import TaskReplayer
from hierroom.worlds.task.spaces import feature_of
from hierroom.worlds.task.trial import try_out
from hierroom.worlds.task.vector_world import VectorWorld
from hierroom.worlds.task.world import TaskWorld
from hierroom.worlds.window import without_window
from hierroom.worlds.world import Feature


@dataclass(frozen=True, eq=False)
class Task:
    """Your own Gymnasium environment as a task for two agents, with goals; without goals it is one for flat agents.

    Args:
        make: a function that makes the environment, without arguments or with ``render_mode`` alone; or an id for
            `gymnasium.make`. Its actions may be Discrete, MultiDiscrete, MultiBinary, or Box with finite bounds.
        goals: for each goal a function of the environment that ``make`` made and the info of its last step. It returns
            whether the goal is achieved, or how often it was achieved so far. A step achieves the goal when the result
            becomes true or grows. None, or none of them: ``meta_0`` has nothing to pick, and no episode is a success.
        rules: for each goal the facts that it ``needs``, ``uses`` and ``gives``, as for `Rules`; by default a goal
            gives itself. Or `Rules`, with a rule for each goal. None: no rules.
        target: the goal that ends an episode with success. None: only the environment ends episodes, none is a
            success, and what counts is the score over all goals (`evaluation.geometric_mean`).
        max_steps: steps after which an episode is truncated, if the environment does not end it first.
        vectors: for each goal the numbers that an agent's observation shows for it; None: one-hot.
        capacity: largest counts of facts of the rules; 1 by default.
        processes: number of processes for the environments; 0: this process.
        symbols: names of the images of bytes that are grids of symbols, such as MiniGrid's ``image``; all others are
            pixels. None: those up to 31 cells a side that show few and small numbers in a short trial.
        action_mask: the name of the legal actions in the info, the observation or as a method of the environment, for
            Discrete actions. None: ``action_mask``, or the method ``action_masks``, if it has one; "": there is none.
        label: the name in titles, tables and messages; None: ``package.module:name``, if the task is given so.
        make_vec: in place of ``make`` a function of ``num_envs`` that makes a vector environment. A goal is then a
            function of the vector and the infos of its last step, with one result for each environment, [N].

    Examples:
        >>> goals = {"far shore": lambda env, info: env.unwrapped.s == 15}
        >>> task = hierroom.Task("FrozenLake-v1", goals, target="far shore")
        >>> env = hierroom.env(task=task)
        >>> env.reset(seed=0)
        >>> env.agent_selection, env.observation_space("controller_0")["action_mask"].shape
        ('meta_0', (4,))
        >>> task.new_env().spec.id, len(task.make_world(hierroom.EnvConfig(task=task), num_envs=2).goals)
        ('FrozenLake-v1', 1)
    """

    make: Callable[..., gymnasium.Env] | str | None = None
    goals: Mapping[str, GoalFunction] = field(default_factory=dict)
    rules: Mapping[str, Any] | Rules | None = None
    target: str | None = None
    max_steps: int = DEFAULT_MAX_STEPS
    vectors: Mapping[str, Sequence[float]] | None = None
    capacity: Mapping[str, int] | None = None
    processes: int = 0
    symbols: Sequence[str] | None = None
    action_mask: str | None = None
    label: str | None = None
    make_vec: Callable[[int], VectorEnv] | None = None

    def __post_init__(self) -> None:
        if (self.make is None) == (self.make_vec is None):
            raise InputError("a task has exactly one of make, for one environment, and make_vec, for a vector of them")
        if self.make_vec is not None and not callable(self.make_vec):
            raise InputError(f"make_vec of a task is a function of num_envs, not {shown(self.make_vec)}")
        if self.make_vec is not None and self.processes:
            raise InputError("processes of a task are for make; a vector from make_vec has its own")
        if self.make is not None and not callable(self.make) and not (isinstance(self.make, str) and self.make):
            raise InputError(
                f"make of a task is a function that makes its environment or an id, not {shown(self.make)}"
            )
        goals: Any = {} if self.goals is None else self.goals
        if not isinstance(goals, Mapping):
            raise InputError(f"goals of a task are functions by name, not {shown(goals)}")
        for name, function in goals.items():
            read_name("the name of a goal", name)
            if not callable(function):
                raise InputError(f"goal {name!r} must be a function of environment and info, not {shown(function)}")
        object.__setattr__(self, "goals", dict(goals))  # the caller may go on to change theirs
        if self.label is not None:
            read_name("the label of a task", self.label)
        require_number("max_steps", self.max_steps, 1, 10**6, is_whole=True)
        require_number("processes", self.processes, 0, 2**10, is_whole=True)
        if self.symbols is not None:
            if not isinstance(self.symbols, (list, tuple)):
                raise InputError(f"symbols of a task are a list of names of entries, not {shown(self.symbols)}")
            object.__setattr__(self, "symbols", tuple(read_name("an entry of symbols", one) for one in self.symbols))
        if not isinstance(self.action_mask, str | None):
            raise InputError(f"action_mask of a task is a name, not {shown(self.action_mask)}")
        self.goal_set  # noqa: B018 - refuses a wrong target and wrong vectors now
        object.__setattr__(self, "rules", self._rules())

    def __repr__(self) -> str:
        return f"<Task {self.name}, goals {', '.join(self.goal_set.names) or 'none'}>"

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy only the entries, because features contain functions without a name."""
        entries = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return entries if self.name == "task" else {**entries, "label": self.name}  # a copy has the same name

    @property
    def name(self) -> str:
        """The label, or ``package.module:name`` if the module of one of its functions holds it, else ``task``."""
        modules = {home: vars(sys.modules[home]) for home in sorted(self.homes & {*sys.modules})}
        found = (f"{home}:{name}" for home, held in modules.items() for name, one in [*held.items()] if one is self)
        return self.label or next(found, "task")

    @property
    def homes(self) -> set[str]:
        """The modules that its functions come from."""
        return {getattr(function, "__module__", "") for function in (self.make, self.make_vec, *self.goals.values())}

    def _rules(self) -> Rules | None:
        if self.rules is None:
            if self.capacity:
                raise InputError("the capacity of a task is that of facts of its rules, and there are no rules")
            return None
        if not isinstance(self.rules, (Rules, Mapping)):
            raise InputError(f"rules of a task are a mapping from goals to what each needs, not {shown(self.rules)}")
        names = self.rules.names if isinstance(self.rules, Rules) else tuple(self.rules)
        found = {
            "lack": [name for name in self.goals if name not in names],
            "have": [name for name in names if name not in self.goals],
        }
        if wrong := [f"{what} {', '.join(map(repr, some))}" for what, some in found.items() if some]:
            raise InputError(f"a task has a rule for each goal ({', '.join(self.goals)}); these {', '.join(wrong)}")
        if isinstance(self.rules, Rules):
            rules = replace(self.rules, capacity={**self.rules.capacity, **(self.capacity or {})})
            if self.target and not any(rules.target in way.gives for way in rules.rules[self.target]):
                raise InputError(f"the target {self.target!r} does not give the target of its rules, {rules.target!r}")
        else:
            given = {name: _giving_itself(name, rule) for name, rule in self.rules.items()}
            rules = Rules(given, self.target or next(iter(given), ""), self.capacity or {}, label=self.label)
            if self.target is None:  # rules lead somewhere: to the first of the deepest goals
                depths = goal_depths(rules)
                rules = Rules(given, max(depths, key=depths.__getitem__), self.capacity or {}, label=self.label)
        there = {fact for ways in rules.rules.values() for way in ways for fact in way.gives}
        there |= {fact for fact, n in rules.start.items() if n}
        for name, ways in rules.rules.items():
            for fact in (fact for way in ways for fact in (*way.needs, *way.uses)):
                if fact not in there:
                    raise InputError(f"the rule of goal {name!r} asks for {fact!r}, which no rule gives")
        depths = goal_depths(rules)
        for name in (self.target,) if self.target else depths:
            if math.isinf(depths[name]):
                why = "goals on the way need each other, or more of a fact than its capacity"
                named = f"the {'target' if self.target else 'goal'} {name!r}"
                raise InputError(f"no order of the rules of a task achieves {named}: {why}")
        return rules

    @cached_property
    def goal_set(self) -> GoalSet:
        """The goals as agents know them."""
        goals = GoalSet.one_hot(tuple(self.goals), self.target)
        if self.vectors is None:
            return goals
        rule = "vectors of a task are equally many finite numbers for each goal"
        if not isinstance(self.vectors, Mapping) or self.vectors.keys() != self.goals.keys():
            raise InputError(f"{rule}; those given are of {shown(self.vectors)}")
        try:
            rows = np.array([self.vectors[name] for name in self.goals], np.float32)
        except (TypeError, ValueError):
            rows = np.zeros(0, np.float32)
        if rows.ndim != 2 or not rows.size or not np.isfinite(rows).all():
            raise InputError(f"{rule}; those given have no common length above 0, or are no finite numbers")
        return replace(goals, vectors=np.concatenate([rows, np.zeros_like(rows[:1])]))

    def new_env(self, render_mode: str | None = None) -> gymnasium.Env:
        """Return a new environment, in a render mode if it takes one."""
        if self.make is None:
            raise InputError(f"the environments of {self.name} come as a vector, so none can be replayed or drawn")
        with user_code(f"make of {self.name}"), without_window():
            env = self._make(render_mode)
        if not isinstance(env, gymnasium.Env):
            raise InputError(f"make of {self.name} must return a gymnasium.Env, not {shown(env)}")
        return env

    def new_vector(self, num_envs: int) -> VectorEnv:
        """Return a new vector of environments, of a task with ``make_vec``."""
        assert self.make_vec is not None
        with user_code(f"make_vec of {self.name}"), without_window():
            vector = self.make_vec(num_envs)
        if not isinstance(vector, VectorEnv) or vector.num_envs != num_envs:
            raise InputError(
                f"make_vec of {self.name} must return a VectorEnv of {num_envs} environments, not {shown(vector)}"
            )
        return vector

    def _make(self, render_mode: str | None) -> Any:
        make: Any = partial(gymnasium.make, self.make) if isinstance(self.make, str) else self.make
        if render_mode is None:
            return _made(make, {}, {"render_mode": None})[0]
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*possible render_modes")  # drawing it says so, in one line
            env, entries = _made(make, {"render_mode": render_mode}, {})
        if isinstance(env, gymnasium.Env) and not (entries or isinstance(self.make, str)):
            with suppress(AttributeError):  # of some it is fixed
                env.unwrapped.render_mode = render_mode  # most environments read it where they draw
        return env

    @cached_property
    def trial(self) -> Trial:
        """Facts found by a few random steps in one environment; errors of the task are raised here."""
        return try_out(cast(TaskParts, self))

    @property
    def actions(self) -> Actions:
        """The kind of the controller's actions."""
        return self.trial.actions

    @property
    def n_actions(self) -> int:
        """The controller's number of actions; 0 if they are arrays."""
        return self.actions.n

    @cached_property
    def features(self) -> dict[str, Feature]:
        """Features that networks can read: each entry of the observation, and the status of each goal."""
        found, is_guess = self.trial.symbols, self.symbols is None
        spaces = ((name, space) for name, (_, space) in self.trial.entries.items())
        entries = {name: feature_of(name, space, found.get(name, 0), is_guess) for name, space in spaces}
        return {**entries, "goal-status": goal_status(len(self.goals))}

    @cached_property
    def replayer(self) -> TaskReplayer:
        """The replayer, which replays episodes and draws them."""
        return TaskReplayer(cast(TaskParts, self))

    @property
    def controller_features(self) -> tuple[str, ...]:
        """Features of the controller: the whole observation, the goal, and the last action if it is a number."""
        last = ("previous-action",) if self.n_actions else ()
        return (*self.trial.entries, "symbol" if self.vectors is None else "goal", *last)

    @property
    def meta_features(self) -> tuple[str, ...]:
        """Features of a meta-controller: the whole observation, and the status of each goal."""
        return (*self.trial.entries, "goal-status", "goal-outcome")

    def make_world(self, config: EnvConfig, num_envs: int, **settings: Any) -> Any:
        """Return N environments of the task; ``settings`` as for `worlds.make.make_world`."""
        kind = TaskWorld if self.make_vec is None else VectorWorld
        return kind(cast(TaskParts, self), config, num_envs, **settings)


def _made(make: Callable[..., Any], *ways: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """Make an environment with the first entries that it takes, and return both: some need a mode, some take none."""
    try:
        return make(**ways[0]), ways[0]
    except TypeError as error:
        if "'render_mode'" not in str(error) and "takes no arguments" not in str(error):
            raise
    return make(**ways[1]), ways[1]


def _giving_itself(name: str, rule: Any) -> Any:
    if isinstance(rule, (list, tuple)) and not isinstance(rule, Alternative):
        return [_giving_itself(name, way) for way in rule]
    return {**rule, "gives": rule.get("gives", name)} if isinstance(rule, Mapping) else rule
