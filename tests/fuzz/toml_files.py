"""Fuzzing of TOML files, of configs and of goal graphs: each ends with exit code 0, or with 2 and one line.

``python -m tests.fuzz.toml_files --count 5000`` tries so many; the seed fixes them.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hierroom.runs.config.config import TrainConfig

from .commands import MANY_DIGITS, SMALL_OPTIONS, TEXTS, end_of, report, wrong_end
from .configs import VALUES, damaged

NAMES = [*TrainConfig().entries]


def as_toml(value: Any) -> str:
    """Write a value as TOML; values without a TOML form, such as null, become invalid TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(name)} = {as_toml(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(as_toml, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value)


def config(rng: random.Random) -> str:
    lines = [f"{rng.choice(NAMES)} = {as_toml(rng.choice(VALUES))}" for _ in range(rng.randrange(1, 4))]
    if rng.randrange(4) == 0:
        lines += [
            rng.choice(("[meta_ppo]", "[ppo]", "[[meta_ppo]]", "[a.b.c]", "[env")),
            f"gamma = {rng.choice(TEXTS)}",
        ]
    text = "\n".join(lines)
    return damaged(text, rng) if rng.randrange(6) == 0 else text


def graph(rng: random.Random) -> str:
    n_rooms = rng.choice((1, 2, 3, 6, 7, 40, 1500))
    rooms: Any = [rng.choice((0, room, rng.randrange(n_rooms + 1))) for room in range(n_rooms)]
    rooms = rng.choice((rooms, rooms, rooms, rng.choice(VALUES), [rng.choice(VALUES)]))
    exit_room = rng.choice((1, 1, n_rooms, rng.choice(VALUES)))
    lines = [f"key_rooms = {as_toml(rooms)}", f"exit_room = {as_toml(exit_room)}"]
    if rng.randrange(2):
        lines += [f"name = {as_toml(rng.choice(TEXTS))}"]
    if rng.randrange(8) == 0:
        lines += [f"exit_rooms = {MANY_DIGITS}"]
    text = "\n".join(lines)
    return damaged(text, rng) if rng.randrange(6) == 0 else text


def attempts(seed: int) -> Iterator[tuple[str, str | None]]:
    rng = random.Random(seed)
    while True:
        is_config = rng.randrange(2)
        text = config(rng) if is_config else graph(rng)
        Path("tried.toml").write_text(text, encoding="utf-8", errors="surrogatepass")
        train = ("train", [*SMALL_OPTIONS[2:], "--config" if is_config else "--graph", "tried.toml"])
        name, words = train if is_config else rng.choice((train, ("complexity", ["--graph", "tried.toml"])))
        yield text, wrong_end(*end_of(name, words))


if __name__ == "__main__":
    raise SystemExit(report(__doc__, "TOML files", attempts))
