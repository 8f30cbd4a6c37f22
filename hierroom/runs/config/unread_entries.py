"""Entries of a config that have no effect, because of its other entries."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from hierroom.agents.config import DEFAULT_NETWORK
from hierroom.meta import LEARNED, META_CONTROLLERS
from hierroom.runs.config.config import ENTRIES, OF_META, TrainConfig
from hierroom.runs.config.presets import preset_in_world
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.make import world_spec


def entries_without_effect(config: TrainConfig) -> dict[str, str]:
    """Return the entries that have no effect on training, whatever their values, each with the reason in words."""
    method = config.resolved_method
    is_learned, has_scripted = method.meta == LEARNED, method.meta in META_CONTROLLERS
    reads_goals = method.sees_goal or method.reward not in REWARDS or method.reward == "intrinsic"
    is_read = {
        "meta": reads_goals or not has_scripted or method.meta == "none",
        "subgoal_horizon": reads_goals or not has_scripted,
        "goal_mask": reads_goals or not has_scripted,
        **{name: is_learned for name in ENTRIES if name.startswith(OF_META)},
        "meta_start_success": is_learned,
        "meta_features": is_learned,
        "novelty_bonus": method.reward == "novelty",
        "curiosity_weight": method.is_curious,
    }
    reward = method.reward if isinstance(method.reward, str) else "custom"
    agents = f"on {config.agents.method} with meta-controller {method.meta} and reward {reward}"
    unread = {name: agents for name, one in is_read.items() if not one}
    for name, part in (("min_advantage_std", config.ppo), (f"{OF_META}min_advantage_std", config.meta_ppo)):
        if not part.normalize_advantages:
            unread[name] = "without normalize_advantages"
    if not config.evaluations:
        unread["evaluation_episodes"] = "without evaluations"
    world = world_spec(config.env)
    read = {OF_META: config.agents.meta_features or world.meta_features} if is_learned else {}
    for prefix, names in {"": config.agents.features or world.controller_features, **read}.items():
        own = config.meta_ppo if prefix else config.ppo
        features = [world.features[name] for name in names if name in world.features]
        kinds = {feature.array.kind for feature in features if feature.array is not None}
        for name, kind, what in (("pictures", "pixels", "pictures"), ("scale_observations", "numbers", "numbers")):
            if not prefix and config.agents.network != DEFAULT_NETWORK:
                unread[name] = "on a custom network"
            elif kind not in kinds and (own.memory == "none" or not kinds):  # with memory, arrays have two encoders
                unread[f"{prefix}{name}"] = f"without {what} in observations"
    return unread


def warn_of_unread(config: TrainConfig, given: Iterable[str]) -> None:
    """Warn the caller's caller of the given entries that have no effect on a trained agent."""
    unread = entries_without_effect(config)
    for name in given:
        if name in unread:
            warnings.warn(f"{name} has no effect {unread[name]}", stacklevel=3)


def unread_note(config: TrainConfig) -> str | None:
    """Return a line on the entries without effect that differ from the config's preset; None if there are none."""
    own, usual = config.entries, preset_in_world(config.preset, config.env).entries
    names: dict[str, list[str]] = {}
    for name, why in {**entries_without_effect(config), "levels": "on training, which sets it"}.items():
        if own[name] not in (usual[name], None):
            names.setdefault(why, []).append(name)
    parts = [f"{', '.join(some)} {'have' if len(some) > 1 else 'has'} no effect {why}" for why, some in names.items()]
    return "; ".join(parts) or None
