"""The name of a run: method, world and differences from its preset."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hierroom.goals import spec_names
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import implied_preset, preset_in_world
from hierroom.worlds.make import ships

MAX_LENGTH = 97
"""The most characters of a name: with -2, -3, ... added, it has at most 100."""
MAX_NAMED_GRAPHS = 4
"""The most graphs or sets of them that a name lists; it gives the number of the others."""
_META_LENGTH, _GRAPH_LENGTH, _SEED_LENGTH = 20, 24, 18
_SEPARATE = frozenset({"method", "meta", "graph", "exclude", "task", "layout", "seed", "preset"})
_NEVER_NAMED = frozenset({"threads", "device", "film", "evaluation_steps"})


def run_name(config: TrainConfig) -> str:
    """Return a short name for a run, valid for a folder on any system: at most 97 letters, digits and ``-_.``.

    It has the method, meta-controller, goal graph, seed, preset, and as many differences from the preset as fit; a
    digest stands for the others. Threads and device are left out, because a resumed run may have others.
    """
    method, meta = config.agents.method, config.resolved_method.meta
    task = config.env.task
    played = config.env.names if task is None or ships(task) else map(_task_name, config.env.names)
    graphs = [*_few(played), *(f"no-{name}" for name in _few(spec_names(config.env.exclude)))]
    parts = (
        method,
        "" if meta == "none" else _shortened(meta.rpartition(":")[2], _META_LENGTH),
        _shortened("-".join(graphs), _GRAPH_LENGTH),
        _shortened(f"seed{config.seed}", _SEED_LENGTH),
        "" if config.preset == implied_preset({"meta": meta, "task": task}) else config.preset,
    )
    head = "-".join(plain(part) for part in parts if part)
    usual, omitted = preset_in_world(config.preset, config.env).entries, _SEPARATE | _NEVER_NAMED
    changed = {name: one for name, one in config.entries.items() if name not in omitted and one != usual[name]}
    differences = [plain(_text(name, one, usual[name])) for name, one in changed.items()]
    whole = "-".join([head, *differences])
    if len(whole) <= MAX_LENGTH:
        return whole
    digest = hashlib.sha256(whole.encode()).hexdigest()[:6]
    name, n_left_out, room = head, 0, MAX_LENGTH - len(f"-and{len(differences)}-{digest}")
    for difference in differences:
        longer = f"{name}-{difference}"
        name, n_left_out = (longer, n_left_out) if len(longer) <= room else (name, n_left_out + 1)
    return f"{name}-and{n_left_out}-{digest}"


def _few(names: Iterable[str]) -> list[str]:
    names = [*names]
    n_more = len(names) - MAX_NAMED_GRAPHS
    return [*names[:MAX_NAMED_GRAPHS], f"and-{n_more}-more"] if n_more > 0 else names


def _text(name: str, value: Any, usual: Any) -> str:
    if isinstance(value, bool):
        return name if value else f"no-{name}"
    if name == "steps":
        return name + _steps(value)
    if isinstance(value, tuple):
        return f"{name}-{'-'.join(_names(value, usual or ())) or 'none'}"  # None: a task's own features
    if value is None or isinstance(value, str):
        return f"{name}-{Path(value).name if name == 'warm_start' and value else str(value).rpartition(':')[2]}"
    return name + str(value).removesuffix(".0").replace("e+", "e")


def _names(value: tuple[str, ...], usual: tuple[str, ...]) -> list[str]:
    left_out, added = [one for one in usual if one not in value], [one for one in value if one not in usual]
    changes = [*(["without", *left_out] if left_out else []), *(["with", *added] if added else [])]
    is_in_order = [one for one in value if one in usual] == [one for one in usual if one in value]
    return changes if is_in_order and len(changes) < len(value) else [*value]


def _task_name(spec: str) -> str:
    if "." not in spec and len(spec) <= _GRAPH_LENGTH:
        return spec
    return f"{spec.rpartition(':')[2][: _GRAPH_LENGTH - 5]}-{hashlib.sha256(spec.encode()).hexdigest()[:4]}"


def _steps(steps: int) -> str:
    if steps >= 10**6 and steps % 10**4 == 0:
        return f"{steps / 10**6:.12g}M"
    return f"{steps // 1000}k" if steps % 1000 == 0 else str(steps)


def plain(text: str) -> str:
    """Return the text in characters that every file system accepts. Windows drops a dot at the end, so replace it."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "-" for c in text)
    return f"{kept[:-1]}-" if kept.endswith(".") else kept


def _shortened(text: str, length: int) -> str:
    if len(text) <= length:
        return text
    return f"{text[: length - 5]}-{hashlib.sha256(text.encode()).hexdigest()[:4]}"
