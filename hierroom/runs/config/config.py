"""The config of a training run. This module imports neither the world nor torch, so that ``--help`` is fast."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, Literal

import msgspec
import tyro
from msgspec import Meta

from hierroom.agents.config import ESCAPE_ROOM_FEATURES, USUAL_FEATURES, AgentsConfig, Method, require_features
from hierroom.goals import NAMED_GRAPHS, is_graph_set, plain_specs, spec_names
from hierroom.learners.config import PPOConfig
from hierroom.support.errors import InputError, shown
from hierroom.support.typed_value import Seed, check_entries, entry_types
from hierroom.worlds.env_config import MOST_ENVS, EnvConfig

PresetName = Literal["default", "task", "long", "large", "learned", "paper", "algorithm1"]
"""Names in `presets.PRESETS`."""

META_PPO = PPOConfig(sequence_length=8, sequences_per_update=32, gamma=0.998, value_weight=0.5, min_advantage_std=0.05)
"""For learning to choose goals. Decisions are rare, so 256 of them make an update. The discount lets the exit count 500
steps before it, as is needed while the controller is slow."""
MOST_EVALUATION_EPISODES = 10**7


@dataclass(frozen=True)
class TrainConfig:
    """Train an agent in EscapeRooms or in a task.

    Args:
        env: the environment.
        agents: the two agents.
        ppo: hyperparameters of the controller's learner.
        meta_ppo: hyperparameters of a learned meta-controller's learner; its turns are options.
        preset: defaults of the other entries: default, task (your own tasks), long (five million steps and the shortest
            paths), large (grids of 31 cells and more), learned (a learned meta-controller in EscapeRooms), paper
            (section 3 of the paper) or algorithm1 (the paper's Algorithm 1). The run's name lists the differences.
        steps: primitive steps to train for, over all environments.
        evaluations: number of evaluations during training, after one before the first step, at equal ratios of the
            steps. They play the same levels each time, none of them seen in training. 0: never.
        evaluation_episodes: episodes of each evaluation. None: 100, or fewer once the success rate of a failing agent
            is clear.
        evaluation_steps: most steps of all evaluations, which then play fewer episodes, or none early on. None: any
            number; but a run of your own task decides it, unless you ask for other evaluations: about 10% of its time.
        seed: determines levels, weights, actions and shuffles.
        num_envs: number of environments that train in parallel.
        stagger_clocks: whether the first episodes begin with different step counts, so that not all environments reach
            the limit together.
        threads: most threads for updates, used where a minibatch has more than 16 sequences (more than 64 environments
            with 4 minibatches), and for steps of 512 environments or more; they do not change results. With pictures
            torch uses them too, which changes rounding.
        device: device of the learner: cpu, cuda, cuda:1, ...
        warm_start: start from the weights of another controller: of a run's folder, a .safetensors file, or a built-in
            agent (a to g). The two controllers must have the same network, features and actions.
        film: whether the run ends with a film of an episode, a GIF. None: yes; but a run of your own task decides
            against it, and says so, if it may take more than ten seconds and a tenth of the run, or cannot be drawn.

    Examples:
        >>> config = hierroom.TrainConfig(steps=2_000_000).changed(method="ppo", graph="g", gamma=0.99)
        >>> config.entries["method"], config.env.names, config.ppo.gamma
        ('ppo', ('g',), 0.99)
    """

    env: tyro.conf.OmitArgPrefixes[EnvConfig] = field(default_factory=EnvConfig)
    agents: tyro.conf.OmitArgPrefixes[AgentsConfig] = field(default_factory=AgentsConfig)
    ppo: tyro.conf.OmitArgPrefixes[PPOConfig] = field(default_factory=PPOConfig)
    meta_ppo: PPOConfig = META_PPO
    preset: PresetName = "default"
    steps: Annotated[int, Meta(ge=1, le=10**15)] = 1_000_000
    evaluations: Annotated[int, Meta(ge=0, le=10**4)] = 16
    evaluation_episodes: Annotated[int, Meta(ge=1, le=MOST_EVALUATION_EPISODES)] | None = None
    evaluation_steps: Annotated[int, Meta(ge=1, le=10**15)] | None = None
    seed: Seed = 0
    num_envs: Annotated[int, Meta(ge=1, le=MOST_ENVS)] = 64
    stagger_clocks: bool = True
    threads: Annotated[int, Meta(ge=1, le=2**10)] = min(2, os.cpu_count() or 1)
    device: str = "cpu"
    warm_start: str | None = None
    film: bool | None = None

    def __post_init__(self) -> None:
        if isinstance(self.warm_start, os.PathLike):
            object.__setattr__(self, "warm_start", os.fspath(self.warm_start))
        check_entries(self)
        if self.warm_start == "":
            raise InputError("warm_start must be a folder, a file or the name of an agent, not ''")
        for name, kind in PARTS.items():
            if not isinstance(part := getattr(self, name), kind):
                raise InputError(f"{name} must be of type {kind.__name__}, not {shown(part)}")
        if self.env.task is None:
            given = {name: getattr(self.agents, name) for name in USUAL_FEATURES}
            own = {name: USUAL_FEATURES[name] if one is None else one for name, one in given.items()}
            for name, features in own.items():
                require_features(name, features, ESCAPE_ROOM_FEATURES)
            object.__setattr__(self, "agents", replace(self.agents, **own))

    @property
    def resolved_method(self) -> Method:
        """The agents: those of the method, except where the config names others."""
        return self.agents.resolved_method(self.env.reward)

    @property
    def title(self) -> str:
        """Return a description of the run in one line."""
        return self.title_on(self.env.names)

    def title_on(self, names: Sequence[str]) -> str:
        """Return the title with other names of what is played, such as a task's label."""
        agents = f"{self.agents.method} with meta-controller {self.resolved_method.meta}"
        played, excluded = ", ".join(names), ", ".join(spec_names(self.env.exclude))
        where = f"{self.env.kind} {played}{f' without {excluded}' if excluded else ''}, seed {self.seed}"
        return f"{agents} on {where}, preset {self.preset}: {self.steps:,} steps in {self.num_envs} environments"

    @property
    def entries(self) -> dict[str, Any]:
        """All entries by their flat names, see `ENTRIES`; `changed` accepts them."""
        return {name: getattr(getattr(self, part) if part else self, field) for name, (part, field) in ENTRIES.items()}

    def changed(self, **entries: Any) -> TrainConfig:
        """Return the config with some entries changed, by flat names (see `ENTRIES`) or as whole parts like ``ppo``."""
        if entries.get("preset", self.preset) != self.preset:
            raise InputError(
                f"a config keeps its preset: one from {self.preset} cannot be changed to "
                f"{entries['preset']}; change single entries instead"
            )
        task = entries.get("task", getattr(entries.get("env", self.env), "task", None))
        if task is not None and task != self.env.task and "agents" not in entries:
            entries = {**dict.fromkeys(USUAL_FEATURES), **entries}  # features are those of a world
        changes: dict[str, dict[str, Any]] = {"": {name: entries.pop(name) for name in PARTS.keys() & entries.keys()}}
        for name in sorted(entries.keys() - ENTRIES.keys()):
            near = get_close_matches(name, [*ENTRIES, *PARTS], n=1)
            hint = f"; is it {near[0]}?" if near else ""
            raise InputError(f"the config of a training run has no {name}{hint}")
        for name, value in entries.items():
            part, field = ENTRIES[name]
            changes.setdefault(part, {})[field] = value
        whole = changes.pop("")
        for part, within in changes.items():  # all parts before the check, as features are those of the world
            if not isinstance(before := whole.get(part, getattr(self, part)), PARTS[part]):
                break  # the new config refuses it
            try:
                whole[part] = before.changed(**within) if isinstance(before, EnvConfig) else replace(before, **within)
            except InputError as error:
                raise InputError(f"{OF_META if part == META_PART else ''}{error}") from error
        return replace(self, **whole)

    def to_dict(self) -> dict[str, Any]:
        """Return plain types for JSON, with the content of user-defined graphs and layouts instead of their paths."""
        named = {
            "reward": self.env.reward,
            "task": self.env.task,
            "meta": self.agents.meta,
            "network": self.agents.network,
        }
        for name, given in named.items():
            if not isinstance(given, str | None):
                raise InputError(f"a run names its {name}, like package.module:name; it cannot hold {given!r}")
        table = dataclasses.asdict(self)
        table["env"] |= {"graph": plain_specs(self.env.graph), "exclude": plain_specs(self.env.exclude)}
        table["env"]["layout"] = [one.to_dict() for one in self.env.layout]
        return table

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> TrainConfig:
        """Return the config that `to_dict` gave."""
        try:
            entries = msgspec.structs.asdict(msgspec.convert(table, _file_type()))
            for specs in (entries["env"].graph, entries["env"].exclude):
                for spec in specs if isinstance(specs, tuple) else (specs,):
                    if isinstance(spec, str) and not (spec in NAMED_GRAPHS or is_graph_set(spec)):
                        raise InputError(f"goal graphs must be given by content or by a letter, not as {spec!r}")
            layout = entries["env"].layout
            if any(isinstance(one, str) for one in ((layout,) if isinstance(layout, str) else layout)):
                raise InputError("layouts must be given by content, not as paths or texts")
            parts = {name: part(**msgspec.structs.asdict(entries[name])) for name, part in PARTS.items()}
            return cls(**{**entries, **parts})
        except (InputError, msgspec.ValidationError) as error:
            raise InputError(f"this is not the config of a training run: {error}") from error

    def differences(self, other: TrainConfig, ignored: Collection[str] = ()) -> list[str]:
        """Return a text for each entry in which another config differs, except those that a resumed run may change."""
        theirs, ignored = other.entries, CHANGED_WHEN_RESUMED.union(ignored)
        changed = {name: one for name, one in self.entries.items() if name not in ignored and one != theirs[name]}
        return [f"{name} is {one!r} and was {theirs[name]!r}" for name, one in changed.items()]


META_PART = "meta_ppo"
PARTS: Mapping[str, type] = {"env": EnvConfig, "agents": AgentsConfig, "ppo": PPOConfig, META_PART: PPOConfig}
OF_META = f"{META_PART}."
"""The prefix of the flat names of entries of ``meta_ppo``, as ``ppo`` has the same entries."""
LATER_ENTRIES: Mapping[str, Any] = {
    **{"task": None, "layout": (), "film": None, "evaluation_steps": None},
    **{"memory": "lstm", "pictures": "small", "scale_observations": False, "scale_returns": False},
}
"""Entries that files of earlier versions lack, with their values there."""
CHANGED_WHEN_RESUMED = frozenset({"steps", "threads", "device", "warm_start", "film", "evaluation_steps"})
"""Entries that may change when a run is resumed; the weights of a warm start are in its checkpoints."""


ENTRIES: Mapping[str, tuple[str, str]] = {
    (OF_META if part == META_PART else "") + entry.name: (part, entry.name)
    for part, kind in (*PARTS.items(), ("", TrainConfig))
    for entry in fields(kind)
    if part or entry.name not in PARTS
}
"""The part of the config (empty: the config itself) and the field of each entry, by its name on the command line.

Such names are ``gamma`` and ``steps``; only entries of ``meta_ppo`` have a prefix, such as ``meta_ppo.gamma``.
"""


@cache
def _file_type() -> type[msgspec.Struct]:
    """Return the type of config.json; it requires all entries but `LATER_ENTRIES`, as defaults may change."""

    def record(part: type, types: Mapping[str, Any]) -> type[msgspec.Struct]:
        later = {name: (kind, LATER_ENTRIES[name]) for name, kind in types.items() if name in LATER_ENTRIES}
        fields = [(name, *later.get(name, (kind,))) for name, kind in types.items()]
        return msgspec.defstruct(part.__name__, sorted(fields, key=len), forbid_unknown_fields=True)

    parts = {name: record(part, entry_types(part)) for name, part in PARTS.items()}
    return record(TrainConfig, {**entry_types(TrainConfig), **parts})
