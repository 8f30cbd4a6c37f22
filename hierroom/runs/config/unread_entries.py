"""Entries of a config that have no effect, because of its other entries."""

from __future__ import annotations

from hierroom.meta import LEARNED, META_CONTROLLERS
from hierroom.runs.config.config import ENTRIES, OF_META, TrainConfig
from hierroom.runs.config.presets import find_preset
from hierroom.turns.rewards import REWARDS


def entries_without_effect(config: TrainConfig) -> tuple[str, ...]:
    """Return the entries that have no effect on training, whatever their values."""
    method = config.resolved_method
    is_learned, has_scripted = method.meta == LEARNED, method.meta in META_CONTROLLERS
    reads_goals = method.sees_goal or method.reward not in REWARDS or method.reward == "intrinsic"
    readers = {
        "meta": reads_goals or not has_scripted or method.meta == "none",
        "subgoal_horizon": reads_goals or not has_scripted,
        "goal_mask": reads_goals or not has_scripted,
        **{name: is_learned for name in ENTRIES if name.startswith(OF_META)},
        "meta_start_success": is_learned,
        "meta_features": is_learned,
        "novelty_bonus": method.reward == "novelty",
        "curiosity_weight": method.is_curious,
    }
    return tuple(name for name, is_read in readers.items() if not is_read)


def unread_entries(config: TrainConfig) -> tuple[str, ...]:
    """Return the entries without effect that differ from the config's preset."""
    own, usual = config.entries, find_preset(config.preset).entries
    return tuple(name for name in entries_without_effect(config) if own[name] not in (usual[name], None))


def unread_note(config: TrainConfig) -> str | None:
    """Return a line on the changed entries that have no effect; None if there are none."""
    names, method = unread_entries(config), config.resolved_method
    if not names:
        return None
    reward = method.reward if isinstance(method.reward, str) else "custom"
    agents = f"{config.agents.method} with meta-controller {method.meta} and reward {reward}"
    return f"{', '.join(names)} {'have' if len(names) > 1 else 'has'} no effect on {agents}"
