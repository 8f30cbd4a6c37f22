"""Fuzzing of config.json: each edit ends in one line, or changes nothing that a resumed run may not change.

``python -m tests.fuzz.configs --count 5000`` tries so many; the seed fixes them.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

from hierroom.runs.config.config import TrainConfig

from .commands import MANY_DIGITS, TEXTS, end_of, report, wrong_end

VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 7, 0.5, 1.0, -0.0, 1e308, math.nan, math.inf, -math.inf, 2**31, 2**62),
    *(2**63 - 1, 2**63, 10**20, 10**400, [], {}, [[]], [None], ["c"], ["c", "c"], ["rooms:3"], [1, 2], {"a": 1}, [{}]),
    {"key_rooms": [0, 1, 1], "exit_room": 3, "name": "fork"},
    {"key_rooms": [0, 1, 1], "exit_room": 3, "name": "\x1b[31m"},
    {"key_rooms": [3, 1, 1], "exit_room": 3},
    {"key_rooms": "ab", "exit_room": 1},
    {"key_rooms": [0.5], "exit_room": True},
    {"key_rooms": {"0": 1}, "exit_room": [1]},
    *TEXTS,
)

MAY_CHANGE = ("steps", "threads", "device", "warm_start")
"""Entries that a resumed run may change."""


def paths(table: dict[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the path of each entry of a config, including those of its parts."""
    for name, value in table.items():
        yield (*above, name)
        if isinstance(value, dict):
            yield from paths(value, (*above, name))


def edited(text: str, rng: random.Random) -> str:
    table = deepcopy(json.loads(text))
    place = rng.choice([*paths(table)])
    inner = table
    for name in place[:-1]:
        inner = inner[name]
    kind = rng.randrange(12)
    if kind < 7:
        inner[place[-1]] = rng.choice(VALUES)
    elif kind == 7:
        del inner[place[-1]]
    elif kind == 8:
        inner[rng.choice(TEXTS)] = inner.pop(place[-1])
    elif kind == 9:
        inner[rng.choice([*TEXTS, "steps", "gamma"])] = rng.choice(VALUES)
    else:
        return damaged(text, rng)
    return json.dumps(table)


def damaged(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text))
    deep = "[" * 10**5
    other = text[:at] + chr(rng.randrange(0x110000 - 0x900)) + text[at + 1 :]
    return rng.choice(
        [
            *("", text[:at], text[at:], other, f"\ufeff{text}", text + text, f"[{text}]", "null", "3", deep),
            *(f'{{"env": {deep}', text.replace("0", MANY_DIGITS, 1), "\0" * 99),
        ]
    )


def attempts(seed: int) -> Iterator[tuple[str, str | None]]:
    rng, right = random.Random(seed), Path("kept/config.json").read_text(encoding="utf-8")
    before = TrainConfig.from_dict(json.loads(right))
    while True:
        text = edited(right, rng)
        Path("run/config.json").write_text(text, encoding="utf-8", errors="surrogatepass")
        name, words = rng.choice([("train", ["--resume", "run"]), ("evaluate", ["run", "--episodes", "1"])])
        code, output = end_of(name, words)
        yield text, wrong_end(code, output) or (silent_change(before) if code == 0 else None)


def silent_change(before: TrainConfig) -> str | None:
    """Return the entries in which an accepted config differs from the one before, or None.

    It shares no check with the commands, so that it notices if they forget an entry.
    """
    after = TrainConfig.from_dict(json.loads(Path("run/config.json").read_text(encoding="utf-8-sig")))
    tables = before.to_dict(), after.to_dict()
    places = {path for table in tables for path in paths(table) if path[-1] not in MAY_CHANGE}
    differing = sorted(".".join(path) for path in places if _at(tables[0], path) != _at(tables[1], path))
    return f"taken without a word: {', '.join(differing)}" if differing else None


def _at(table: Any, path: tuple[str, ...]) -> Any:
    """Return the value at a place of a config; None for a table, as each of its entries has its own place."""
    for name in path:
        table = table.get(name, "nothing") if isinstance(table, dict) else "nothing"
    return None if isinstance(table, dict) else table


if __name__ == "__main__":
    raise SystemExit(report(__doc__, "edited config.json", attempts))
