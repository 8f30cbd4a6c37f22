"""What a training run is: every choice in one frozen record.

It loads neither the world nor torch, so that a command can explain itself at once.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import tyro

from hierroom.agents.config import FeatureName, Method, MethodName, find_method
from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.goals import GoalGraph
from hierroom.learners.config import PPOConfig

META_PPO = PPOConfig(sequence_length=8, sequences_per_update=32, gamma=0.998, value_weight=0.5, min_advantage_std=0.05)
"""For learning to choose goals: an update after 256 decisions, as there are few of them; a discount that lets the exit
count 500 steps before it, as is needed while the controller is slow."""


@dataclass(frozen=True)
class TrainConfig:
    """Train an agent in EscapeRooms."""

    env: Annotated[EnvConfig, tyro.conf.arg(name="")] = field(default_factory=EnvConfig)
    """The environment."""
    method: MethodName = "hippo"
    """The pair of agents."""
    meta: str | None = None
    """Who picks the goals: fixed-dfs, random, oracle, learned, none, an entry point or package.module:Class; by
    default the method's own."""
    network: str | None = None
    """The controller's network: recurrent, modular (a sub-policy for each goal), an entry point or
    package.module:Class; by default the method's own."""
    features: tuple[FeatureName, ...] = (
        *("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        *("doorway-places", "frontier-places"),
    )
    """What the controller's network reads of an observation; methods without goals leave out goal, goal-in-view,
    goal-place and symbol."""
    warm_start: str | None = None
    """The folder of a run whose controller this one begins as: its weights and nothing else. The controllers must be
    alike; the meta-controllers need not be."""
    curiosity_weight: float = 0.05
    """The weight of curiosity in the reward of ppo-rnd, its returns scaled to deviation 1; the exit gives 1. On graph a
    (one seed, 1.5M steps, a discount of 0.98) 0.05 ended at 100% success, 0.2 at 82%, 0.5, as in Burda et al. 2018, at
    92%."""
    meta_features: tuple[FeatureName, ...] = ("goal-status", "goal-outcome")
    """What the network of a learned meta-controller reads: features with a number for each goal."""
    meta_start_success: float = 0.03
    """A learned meta-controller draws goals at random until this share of 100 episodes escapes; then it learns."""
    ppo: Annotated[PPOConfig, tyro.conf.arg(name="")] = field(default_factory=PPOConfig)
    """Hyperparameters of the controller's learner."""
    meta_ppo: PPOConfig = META_PPO
    """Hyperparameters of a learned meta-controller's learner, whose turns are options."""
    steps: int = 1_000_000
    """Primitive steps to train for, over all environments."""
    seed: int = 0
    """Fixes levels, weights, actions and shuffles."""
    num_envs: int = 64
    """Environments trained in side by side."""
    threads: int = min(2, os.cpu_count() or 1)
    """Threads to compute with where there is enough to share, from 128 environments on; results do not depend on
    them."""
    device: str = "cpu"
    """Where the learner computes: cpu, cuda, cuda:1, ..."""

    @property
    def pair(self) -> Method:
        """The method, its agents replaced by those that were named."""
        method = find_method(self.method)
        controller = replace(
            method.controller,
            reward=self.env.reward or method.controller.reward,
            network=self.network or method.controller.network,
        )
        return Method(self.meta or method.meta, controller)

    @property
    def name(self) -> str:
        """A short name for the run, fit for a folder."""
        meta, graph = self.pair.meta, self.env.graph
        graph_name = graph.name if isinstance(graph, GoalGraph) else str(graph)
        parts = [self.method, meta if meta != "none" else "", graph_name, f"seed{self.seed}"]
        text = "-".join(part for part in parts if part)
        return "".join(c if c.isalnum() or c in "-_." else "-" for c in text)

    def to_dict(self) -> dict[str, Any]:
        """As plain types, for JSON."""
        table, graph = dataclasses.asdict(self), self.env.graph
        table["env"]["graph"] = graph.name if isinstance(graph, GoalGraph) else str(graph)
        return table

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> TrainConfig:
        """The config that `to_dict` gave.

        Raises:
            InputError: if an entry is missing or unknown.
        """
        try:
            features = {name: tuple(table[name]) for name in ("features", "meta_features")}
            learners = {name: _whole(PPOConfig, table[name]) for name in ("ppo", "meta_ppo")}
            return _whole(cls, {**table, **features, **learners, "env": _whole(EnvConfig, table["env"])})
        except (TypeError, KeyError) as error:
            raise InputError(f"this is not the config of a training run: {error}") from error


def _whole(kind: type, table: Mapping[str, Any]) -> Any:
    """A dataclass from all of its entries: a run's config is not filled up with the defaults of another version."""
    missing = {field.name for field in dataclasses.fields(kind)} - table.keys()
    if missing:
        raise TypeError(f"{', '.join(sorted(missing))} missing")
    return kind(**table)
