"""Print a digest of weights, metrics and evaluations of short runs, one of each kind of agent.

A change that is to compute the same numbers leaves every digest as it was. Run this before and after it, on
one machine.

python -m benchmarks.run_digests
python -m benchmarks.run_digests learned own-meta
"""

from __future__ import annotations

import csv
import hashlib
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch

import hierroom

STEPS = 12_000
EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
TIMES = {"seconds", "compile_seconds", "steps_per_second"}
"""Columns that no two runs share."""
RUNS: dict[str, dict[str, Any]] = {
    "hippo": {"graph": "c"},
    "hippo-drop": {"graph": "f", "drop_key": True, "subgoal_horizon": 60},
    "hippo-bonus": {"graph": "b", "reward": "bonus"},
    "hippo-minibatches": {"graph": "e", "minibatches": 2, "threads": 2, "num_envs": 32},
    "ppo": {"graph": "a", "method": "ppo"},
    "ppo-bonus": {"graph": "d", "method": "ppo-bonus"},
    "ppo-sketch": {"graph": "c", "method": "ppo-sketch"},
    "ppo-novelty": {"graph": "a", "method": "ppo-novelty"},
    "ppo-rnd": {"graph": "a", "method": "ppo-rnd"},
    "random-seen": {"graph": "c", "meta": "random", "goal_mask": "seen"},
    "oracle": {"graph": "c", "meta": "oracle"},
    "learned": {"graph": "a", "meta": "learned", "meta_start_success": 0.0},
    "algorithm1": {"graph": "a", "preset": "algorithm1", "meta_start_success": 0.0},
    "own-meta": {"graph": "g", "meta": "own_meta_controller:NearestKeyFirst"},
    "own-function": {"graph": "g", "meta": "own_meta_controller:nearest"},
    "own-learning-meta": {"graph": "a", "meta": "own_learning_meta:ReachedMostOften"},
    "own-watching-meta": {"graph": "a", "meta": "own_watching_meta:OthersFirst"},
    "own-reward": {"graph": "b", "reward": "own_reward:Closer"},
    "own-network": {"graph": "a", "network": "own_network:GatedMemory"},
    "curriculum": {"graph": ["a", "c", "rooms:3"], "exclude": "b", "curriculum_stages": 3, "max_steps": 60},
    "large-preset": {"graph": "f", "preset": "large"},
}
"""The runs by name: what differs from the default of `hierroom.train`."""


def digest(name: str) -> str:
    """Train one of `RUNS` and return the digests of its weights, metrics, evaluations and episodes."""
    settings = {"num_envs": 16, "size": 13, "evaluations": 2, "evaluation_episodes": 10, "seed": 7, "max_steps": 200}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        hierroom.train(out=out, log="none", quiet=True, steps=STEPS, **{**settings, **RUNS[name]})
        newest = max((out / "checkpoints").glob("*.pt"))
        tables = (_rows(out / f"{table}.csv") for table in ("metrics", "evaluations", "episodes"))
        return "  ".join(_hash(content) for content in (_weights(newest), *tables))


def _hash(texts: Iterator[bytes]) -> str:
    total = hashlib.sha256()
    for text in texts:
        total.update(text)
    return total.hexdigest()[:12]


def _rows(path: Path) -> Iterator[bytes]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        for row in csv.DictReader(file):
            yield repr([(name, value) for name, value in row.items() if name not in TIMES]).encode()


def _weights(path: Path) -> Iterator[bytes]:
    yield from _leaves(torch.load(path, weights_only=True)["agents"], "agents")


def _leaves(value: Any, name: str) -> Iterator[bytes]:
    if isinstance(value, dict):
        for key in sorted(value, key=str):
            yield from _leaves(value[key], f"{name}.{key}")
    elif isinstance(value, (list, tuple)):
        for n, item in enumerate(value):
            yield from _leaves(item, f"{name}.{n}")
    elif isinstance(value, torch.Tensor):
        yield name.encode() + value.contiguous().numpy().tobytes()
    else:
        yield f"{name}={value!r}".encode()


def main() -> None:
    """Print a line for each run."""
    sys.path.insert(0, str(EXAMPLES))
    for name in sys.argv[1:] or RUNS:
        print(f"{name:<18} {digest(name)}", flush=True)


if __name__ == "__main__":
    main()
