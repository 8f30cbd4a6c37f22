"""What a training run is: every choice in one frozen record, and the presets it starts from."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from hierroom.controller import NOVELTY_BONUS
from hierroom.errors import InputError
from hierroom.learners import PPOConfig
from hierroom.methods import find_method

META_PPO = PPOConfig(sequence_length=8, sequences_per_update=32, gamma=0.998, value_weight=0.5, min_advantage_std=0.05)
"""For learning to choose goals: an update after 256 decisions, as there are few of them; a discount that lets the exit
count 500 steps before it, as is needed while the controller is slow."""


@dataclass(frozen=True)
class TrainConfig:
    """Train an agent in EscapeRooms."""

    method: str = "hippo"
    """ppo, ppo-bonus, ppo-novelty, ppo-rnd, ppo-sketch, ppo-modular or hippo."""
    meta: str | None = None
    """Who picks the goals: fixed-dfs, random, oracle, learned, none, an entry point or package.module:Class; by
    default the method's own."""
    network: str | None = None
    """The controller's network: recurrent, modular (a sub-policy for each goal), an entry point or
    package.module:Class; by default the method's own."""
    warm_start: str | None = None
    """The folder of a run whose controller this one begins as: its weights and nothing else. The controllers must be
    alike; the meta-controllers need not be."""
    graph: str = "c"
    """Goal graph: a letter from a to g, a path to a .toml file, or for all graphs in between hitting_time:LOW..HIGH or
    expected_steps:LOW..HIGH."""
    curriculum_stages: int = 1
    """Parts into which such an interval is cut; training moves on when it escapes in 80% of 200 episodes, and back
    below 20%. 1: all its graphs at once."""
    steps: int = 1_000_000
    """Primitive steps to train for, over all rooms."""
    seed: int = 0
    """Fixes levels, weights, actions and shuffles."""
    size: int = 19
    """Cells of the grid's side, 11 to 63."""
    max_steps: int = 1000
    """Primitive steps after which an episode is truncated."""
    drop_key: bool = False
    """Give the controller a sixth action that drops a key."""
    subgoal_horizon: int | None = None
    """Steps after which a goal's life ends unreached; None: never."""
    goal_mask: str = "reachable"
    """Goals the meta-controller may choose: reachable, existing, seen (or no goal: find something new) or none (all
    there could be)."""
    novelty_bonus: float = NOVELTY_BONUS
    """What ppo-novelty pays for each state entered first in an episode; the exit pays 1."""
    curiosity_weight: float = 0.05
    """What ppo-rnd pays for curiosity, whose returns are scaled to deviation 1; the exit pays 1. On graph a (one seed,
    1.5M steps, a discount of 0.98) 0.05 ended at 100% success, 0.2 at 82%, 0.5, as in Burda et al. 2018, at 92%."""
    rooms: int = 64
    """Rooms trained in side by side."""
    inputs: tuple[str, ...] = (
        *("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        *("doorway-places", "frontier-places"),
    )
    """What the controller is fed of view, view-ids, goal, goal-in-view, goal-place, doorway-places, frontier-places,
    symbol, direction, keys, previous-action and goal-status; methods without goals leave out goal, goal-in-view,
    goal-place and symbol."""
    threads: int = min(2, os.cpu_count() or 1)
    """Threads to compute with where there is enough to share, from 128 rooms on; results do not depend on them."""
    device: str = "cpu"
    """Where the learner computes: cpu, cuda, cuda:1, ..."""
    ppo: Annotated[PPOConfig, tyro.conf.arg(name="")] = dataclasses.field(default_factory=PPOConfig)
    """Hyperparameters of the learner."""
    meta_inputs: tuple[str, ...] = ("goal-status", "goal-outcome")
    """What a learned meta-controller is fed: inputs with a column for each goal."""
    meta_start_success: float = 0.03
    """A learned meta-controller draws goals at random until this share of 100 episodes escapes; then it learns."""
    meta_ppo: PPOConfig = META_PPO
    """Hyperparameters of its learner, whose turns are decisions."""

    @property
    def meta_name(self) -> str:
        """The meta-controller in use: the one given, else the method's own."""
        return self.meta or find_method(self.method).meta

    @property
    def network_name(self) -> str:
        """The controller's network in use: the one given, else the method's own."""
        return self.network or find_method(self.method).network

    @property
    def name(self) -> str:
        """A short name for the run, fit for a folder."""
        parts = [self.method, self.meta_name if self.meta_name != "none" else "", self.graph, f"seed{self.seed}"]
        text = "-".join(part for part in parts if part)
        return "".join(c if c.isalnum() or c in "-_." else "-" for c in text)

    def to_dict(self) -> dict[str, Any]:
        """As plain types, for JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> TrainConfig:
        """The config that `to_dict` gave.

        Raises:
            InputError: if an entry is missing or unknown.
        """
        try:
            inputs = {name: tuple(table[name]) for name in ("inputs", "meta_inputs")}
            learners = {name: _whole(PPOConfig, table[name]) for name in ("ppo", "meta_ppo")}
            return _whole(cls, {**table, **inputs, **learners})
        except (TypeError, KeyError) as error:
            raise InputError(f"this is not the config of a training run: {error}") from error


def _whole(kind: type, table: Mapping[str, Any]) -> Any:
    """A dataclass from all of its entries: a run's config is not filled up with the defaults of another version."""
    missing = {field.name for field in dataclasses.fields(kind)} - table.keys()
    if missing:
        raise TypeError(f"{', '.join(sorted(missing))} missing")
    return kind(**table)


PRESETS: Mapping[str, TrainConfig] = {
    "default": TrainConfig(),
    # At a constant rate the policy goes on wavering: before the doorways and frontiers, at the end of 5M steps with a
    # falling one episodes took 53 and 72 steps on graphs c and f, with a constant one 66 and 87.
    "long": TrainConfig(steps=5_000_000, ppo=PPOConfig(final_learning_rate_fraction=0.1)),
    # Ways are longer there, so there is more to remember, and 3M steps are few. Told of no doorway a controller can
    # stay near chance in branch rooms that it should leave: on graph d one of three seeds ended 2M steps at 83%, told
    # of the last one all three at 99%. Returns that look further ahead (gae_lambda) helped on graph f, a falling rate
    # at the end.
    "large": TrainConfig(
        size=31,
        steps=3_000_000,
        rooms=128,
        ppo=PPOConfig(
            sequence_length=64,
            learning_rate=2e-3,
            final_learning_rate_fraction=0.1,
            value_weight=0.5,
            gamma=0.98,
            gae_lambda=0.98,
        ),
    ),
    "learned": TrainConfig(
        meta="learned",
        goal_mask="existing",
        subgoal_horizon=50,
        steps=3_000_000,
        # Rooms, inputs, discount and the weight of the values are what the default's were when this was measured.
        rooms=128,
        inputs=("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        # Annealed, as what the meta-controller asks for goes on changing: at a constant rate success on graph f fell
        # from 94% to 80% on the way. With an entropy weight of 0.03 the controller stayed near chance on graph e (83%,
        # with 0.01 98%), where most of the time goes into looking for the exit and nothing is paid. Both were measured
        # before the controller was told of its goal's place.
        ppo=PPOConfig(final_learning_rate_fraction=0.1, value_weight=0.5, gamma=0.98),
    ),
    "paper": TrainConfig(
        steps=10_000_000,
        rooms=128,
        inputs=("view-ids", "goal"),
        ppo=PPOConfig(
            sequence_length=128,
            learning_rate=2.5e-4,
            gamma=0.9,
            gae_lambda=0.95,
            value_weight=0.5,
            min_advantage_std=1e-8,
        ),
    ),
}
"""default: the best we know for any method. long: for five million steps; goes the shortest ways. large: for grids of
31 cells and more. learned: a learned meta-controller (the paper's Algorithm 1). paper: section 3 of the paper; what it
leaves open is as was usual. docs/presets.md goes through them value by value."""


def find_preset(name: str) -> TrainConfig:
    """The preset of that name.

    Raises:
        InputError: if there is none.
    """
    if name not in PRESETS:
        raise InputError(f"the presets are {', '.join(PRESETS)}; there is no {name!r}")
    return PRESETS[name]
