"""What a training run is: every choice in one frozen record.

It loads neither the world nor torch, so that a command can explain itself at once.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np
import tyro

from hierroom.agents.config import AgentsConfig, Method
from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.goals import plain_specs, spec_names
from hierroom.learners.config import PPOConfig

PresetName = Literal["default", "long", "large", "learned", "paper", "algorithm1"]
"""What `training.presets.PRESETS` has."""

META_PPO = PPOConfig(sequence_length=8, sequences_per_update=32, gamma=0.998, value_weight=0.5, min_advantage_std=0.05)
"""For learning to choose goals: an update after 256 decisions, as there are few of them; a discount that lets the exit
count 500 steps before it, as is needed while the controller is slow."""


@dataclass(frozen=True)
class TrainConfig:
    """Train an agent in EscapeRooms.

    Args:
        env: the environment.
        agents: the two agents.
        ppo: hyperparameters of the controller's learner.
        meta_ppo: hyperparameters of a learned meta-controller's learner, whose turns are options.
        preset: what the other entries start from: default, long (for five million steps and the shortest paths),
            large (for grids of 31 cells and more), learned (for a learned meta-controller, which implies it), paper
            (section 3 of the paper) or algorithm1 (its Algorithm 1 to the letter). It is kept so that the run's name
            can tell what differs from it.
        steps: primitive steps to train for, over all environments.
        evaluations: how often the agents are evaluated while they learn, apart from training and the same levels each
            time: before the first step, and so many times after, at equal ratios of the steps. 0: never.
        evaluation_episodes: episodes of each.
        seed: fixes levels, weights, actions and shuffles.
        num_envs: environments trained in side by side.
        threads: threads to compute with where there is enough to share, from 128 environments on; results do not
            depend on them.
        device: where the learner computes: cpu, cuda, cuda:1, ...
        warm_start: the folder of a run whose controller this one begins as: its weights and nothing else. The
            controllers must be alike; the meta-controllers need not be.
    """

    env: tyro.conf.OmitArgPrefixes[EnvConfig] = field(default_factory=EnvConfig)
    agents: tyro.conf.OmitArgPrefixes[AgentsConfig] = field(default_factory=AgentsConfig)
    ppo: tyro.conf.OmitArgPrefixes[PPOConfig] = field(default_factory=PPOConfig)
    meta_ppo: PPOConfig = META_PPO
    preset: PresetName = "default"
    steps: int = 1_000_000
    evaluations: int = 16
    evaluation_episodes: int = 100
    seed: int = 0
    num_envs: int = 64
    threads: int = min(2, os.cpu_count() or 1)
    device: str = "cpu"
    warm_start: str | None = None

    def __post_init__(self) -> None:
        for name in ("steps", "evaluations", "evaluation_episodes", "seed", "num_envs", "threads"):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or isinstance(value, bool):
                raise InputError(f"{name} must be a whole number, not {value!r}")

    @property
    def resolved_method(self) -> Method:
        """The agents: those of the method, or what was named in their place."""
        return self.agents.resolved_method(self.env.reward)

    @property
    def title(self) -> str:
        """What the run trains, in a sentence."""
        agents = f"{self.agents.method} with meta-controller {self.resolved_method.meta}"
        graphs, excluded = (", ".join(spec_names(specs)) for specs in (self.env.graph, self.env.exclude))
        where = f"graph {graphs}{f' without {excluded}' if excluded else ''}, seed {self.seed}"
        return f"{agents} on {where}, preset {self.preset}: {self.steps:,} steps in {self.num_envs} environments"

    @property
    def entries(self) -> dict[str, Any]:
        """All entries flat, named as on the command line; those of ``meta_ppo`` stay together."""
        return {**vars(self.env), **vars(self.agents), **vars(self.ppo), **vars(self)}

    def changed(self, **entries: Any) -> TrainConfig:
        """The config with some entries changed, named as on the command line.

        Args:
            **entries: entries of the config itself, of ``env``, ``agents`` and ``ppo``, each by its own name.

        Raises:
            InputError: if there is no such entry.
        """
        if entries.get("preset", self.preset) != self.preset:
            raise InputError(
                f"a config begins with a preset: one that began with {self.preset} cannot be changed to "
                f"{entries['preset']}; change the entries that are to be others"
            )
        parts = {name: {entry.name for entry in fields(getattr(self, name))} for name in ("env", "agents", "ppo")}
        own = {name: entries.pop(name) for name in {entry.name for entry in fields(self)} & entries.keys()}
        config = replace(self, **own)
        for part, names in parts.items():
            within = {name: entries.pop(name) for name in names & entries.keys()}
            config = replace(config, **{part: replace(getattr(config, part), **within)}) if within else config
        for name in sorted(entries):
            near = get_close_matches(name, config.entries, n=1)
            hint = f"; is it {near[0]}?" if near else ""
            raise InputError(f"the config of a training run has no {name}{hint}")
        return config

    def to_dict(self) -> dict[str, Any]:
        """As plain types, for JSON; goal graphs of one's own by their content, whatever becomes of their files.

        Raises:
            InputError: if reward, meta-controller or network have no name that another process could find them by.
        """
        named = {"reward": self.env.reward, "meta": self.agents.meta, "network": self.agents.network}
        for what, given in named.items():
            if not isinstance(given, str | None):
                raise InputError(f"a run names its {what}, like package.module:Class; it cannot hold {given!r}")
        table = dataclasses.asdict(self)
        table["env"] |= {"graph": plain_specs(self.env.graph), "exclude": plain_specs(self.env.exclude)}
        return table

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> TrainConfig:
        """The config that `to_dict` gave.

        Raises:
            InputError: if an entry is missing or unknown.
        """
        try:
            features = {name: tuple(table["agents"][name]) for name in ("features", "meta_features")}
            learners = {name: _whole(PPOConfig, table[name]) for name in ("ppo", "meta_ppo")}
            parts = {"env": _whole(EnvConfig, table["env"]), "agents": _whole(AgentsConfig, table["agents"] | features)}
            return _whole(cls, {**table, **parts, **learners})
        except (TypeError, KeyError) as error:
            raise InputError(f"this is not the config of a training run: {error}") from error


def _whole(kind: type, table: Mapping[str, Any]) -> Any:
    """A dataclass from all of its entries: a run's config is not filled up with the defaults of another version."""
    missing = {entry.name for entry in fields(kind)} - table.keys()
    if missing:
        raise TypeError(f"{', '.join(sorted(missing))} missing")
    return kind(**table)
