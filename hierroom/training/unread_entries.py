"""Entries of a config that nothing reads, because of what else it says."""

from __future__ import annotations

from hierroom.meta import LEARNED
from hierroom.training.config import TrainConfig
from hierroom.training.presets import find_preset


def unread_entries(config: TrainConfig) -> tuple[str, ...]:
    """The entries that are not the preset's and have no effect on what the config trains.

    Args:
        config: of a run.

    Returns:
        names, those of the meta-controller's learner as ``meta_ppo.gamma``.
    """
    method, usual = config.resolved_method, find_preset(config.preset)
    unread: list[str] = []
    if method.meta != LEARNED:
        learner = vars(config.meta_ppo).items()
        unread += [f"meta_ppo.{name}" for name, value in learner if value != vars(usual.meta_ppo)[name]]
    readers = {
        "meta_start_success": method.meta == LEARNED,
        "meta_features": method.meta == LEARNED,
        "novelty_bonus": method.controller.reward == "novelty",
        "curiosity_weight": method.controller.is_curious,
    }
    unread += [name for name, is_read in readers.items() if not is_read]
    own, others = config.entries, usual.entries
    return tuple(name for name in unread if name.startswith("meta_ppo.") or own[name] != others[name])


def unread_note(config: TrainConfig) -> str | None:
    """A line on the entries that have no effect; None where there is none."""
    names, method = unread_entries(config), config.resolved_method
    if not names:
        return None
    reward = method.controller.reward if isinstance(method.controller.reward, str) else "of one's own"
    told = f"{config.agents.method} with meta-controller {method.meta} and reward {reward}"
    return f"{', '.join(names)} {'have' if len(names) > 1 else 'has'} no effect on {told}"
