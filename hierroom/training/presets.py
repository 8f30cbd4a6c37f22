"""The configs that training runs start from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from hierroom.agents.config import AgentsConfig
from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.learners.config import PPOConfig
from hierroom.training.config import TrainConfig

PresetName = Literal["default", "long", "large", "learned", "paper"]

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
        env=EnvConfig(size=31),
        steps=3_000_000,
        num_envs=128,
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
        env=EnvConfig(goal_mask="existing", subgoal_horizon=50),
        agents=AgentsConfig(
            meta="learned",
            features=("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        ),
        steps=3_000_000,
        # Environments, features, discount and value weight are what the default's were when this was measured.
        num_envs=128,
        # Annealed, as what the meta-controller asks for goes on changing: at a constant rate success on graph f fell
        # from 94% to 80% on the way. With an entropy weight of 0.03 the controller stayed near chance on graph e (83%,
        # with 0.01 98%), where most of the time goes into looking for the exit and nothing is paid. Both were measured
        # before the controller was told of its goal's place.
        ppo=PPOConfig(final_learning_rate_fraction=0.1, value_weight=0.5, gamma=0.98),
    ),
    "paper": TrainConfig(
        steps=10_000_000,
        num_envs=128,
        agents=AgentsConfig(features=("view-ids", "goal")),
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
