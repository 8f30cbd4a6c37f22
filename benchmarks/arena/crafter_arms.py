"""Crafter by symbols: how much of it each agent unlocks, with equal symbols, episodes and steps.

    python -m benchmarks.arena.crafter_arms run             # the rows that are lacking; a run takes about 40 minutes
    python -m benchmarks.arena.crafter_arms logs FILE...    # rows of the authors' logs, from github.com/danijar/crafter
    python -m benchmarks.arena.crafter_arms table

Symbols are not pixels, and recipes are told: no row can be compared with Crafter's public table. These rules were
written before the first run:

- Crafter as it is, with night and hunger, and 10,000 steps at most. All arms see 9 x 7 cells as kinds, the counts of
  the inventory, where the player faces, sleep and daylight. Goals are the 22 achievements, rules are the recipes of
  `data.yaml`.
- Arms: PPO with Crafter's own rewards; PPO+Bonus, with 1 for each achievement that is new in the episode; PPO+Bonus
  that sees the script's goal; HiPPO with the script, with learned and with random goals; Stable-Baselines3's PPO. Ours
  have the preset `task`. Each trains a million steps with five seeds, then the best two of ours five million with two.
- The score is Crafter's own, over all training episodes (Hafner 2021, section 4): with s the share of episodes, in
  percent, that unlock an achievement, exp(mean of ln(1 + s)) - 1. A row has the shares themselves.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.arena.families import FAMILIES
from benchmarks.arena.predictions import add_rows
from benchmarks.arena.runs import KEPT, in_process, train_or_go_on
from benchmarks.prediction.play import RESULTS
from hierroom.agents.evaluation import geometric_mean
from hierroom.support.cli import run
from hierroom.support.tables import markdown_table

ROWS = RESULTS / "arena" / "crafter.csv"
TASK = "examples.tasks.crafter_symbols:crafter"
ARMS: Mapping[str, Mapping[str, Any]] = {
    "PPO": {"method": "ppo"},
    "PPO+Bonus": {"method": "ppo-bonus"},
    "PPO+Bonus, sees the goal": {"method": "ppo-bonus", "meta": "fixed-dfs"},
    "HiPPO, script": {"method": "hippo"},
    "HiPPO, learned goals": {"method": "hippo", "meta": "learned"},
    "HiPPO, random goals": {"method": "hippo", "meta": "random"},
    "SB3 PPO": {"n_steps": 128, "batch_size": 64, "n_epochs": 10, "learning_rate": 2.5e-4, "ent_coef": 0.01},
}
"""The last has RL Zoo's settings of MiniGrid."""
THEIRS, NUM_ENVS = "SB3 PPO", 8


def row_of(unlocked: Sequence[Mapping[str, Any]], returns: Sequence[float]) -> dict[str, Any]:
    """Return a row from the achievements of each episode, as counts or truth, and the returns."""
    shares = (pd.DataFrame(unlocked) > 0).mean().sort_index()
    score = float(geometric_mean(shares.to_numpy()))
    numbers = {"episodes": len(unlocked), "score": score, "return": float(np.mean(returns)), **shares}
    return {name: f"{value:.6g}" for name, value in numbers.items()}


def train_one(arm: str, seed: int, steps: int) -> dict[str, Any]:
    """Train an arm and return its row."""
    if arm == THEIRS:
        return row_of(*_theirs(seed, steps))
    settings = {"task": TASK, "steps": steps, "seed": seed, "evaluations": 0}
    folder = train_or_go_on(KEPT / f"crafter-{[*ARMS].index(arm)}-{seed}-{steps}", **settings, **ARMS[arm])
    episodes = pd.read_csv(folder.episodes.path)
    from crafter import constants

    goals = [json.loads(text) for text in episodes.goals]
    return row_of(
        [{name: name in found for name in constants.achievements} for found in goals], episodes["return"].to_list()
    )


def _theirs(seed: int, steps: int) -> tuple[list[Mapping[str, int]], list[float]]:
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env

    from examples.tasks.crafter_symbols import Crafter

    torch.set_num_threads(1)
    model = PPO("MlpPolicy", make_vec_env(lambda: _flat(Crafter()), NUM_ENVS, seed=seed), seed=seed, **ARMS[THEIRS])
    unlocked, returns = [], []

    def collect(local: Mapping[str, Any], _: Any) -> bool:
        ended = [info for info in local["infos"] if "episode" in info]
        unlocked.extend(info["achievements"] for info in ended)
        returns.extend(float(info["episode"]["r"]) for info in ended)
        return True

    model.learn(steps, callback=collect)
    return unlocked, returns


def _flat(env: gymnasium.Env) -> gymnasium.Env:
    """Return an environment that shows one-hot cells and the state in one vector."""
    table = np.eye(32, dtype=np.float32)

    def flat(observation: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
        return np.concatenate([table[observation["view"]].ravel(), observation["state"]])

    space = gymnasium.spaces.Box(-1, 9, (32 * 9 * 7 + 20,), np.float32)
    return gymnasium.wrappers.TransformObservation(env, flat, space)


def logged_rows(path: Path) -> list[dict[str, str]]:
    """Return a row for each seed of a file of the authors' logs, of its first million steps."""
    rows = []
    for one in json.loads(path.read_text(encoding="utf-8")):
        n = int((np.array(one["xs"]) <= 1_000_000).sum())
        names = [name for name in one if name.startswith("achievement_")]
        unlocked = [{name.removeprefix("achievement_"): one[name][k] for name in names} for k in range(n)]
        identity = {"arm": f"{one['method']} (authors' log)", "seed": str(one["seed"]), "steps": str(one["xs"][n - 1])}
        rows.append({**identity, **row_of(unlocked, one["reward"][:n])})
    return rows


def table() -> str:
    """Return the table: the means over seeds, and the deviations of scores."""
    rows = pd.read_csv(ROWS)
    names = [name for name in rows if str(name) not in ("arm", "seed", "steps", "episodes", "score", "return", "error")]
    rows["steps"] = rows.steps.where(~rows.arm.str.contains("log"), 0)  # those of people differ
    groups = [*rows.groupby(["arm", "steps"], sort=False)]
    heads = [f"{arm}, {steps / 1e6:.0f}M" if steps else arm for (arm, steps), _ in groups]
    lines = [["seeds", *(str(len(one)) for _, one in groups)]]
    lines.append(["score", *(f"{one.score.mean():.1%} ({one.score.std(ddof=0):.1%})" for _, one in groups)])
    lines.append(["return", *(f"{one['return'].mean():.2f}" for _, one in groups)])
    lines += [[str(name), *(f"{one[name].mean():.1%}" for _, one in groups)] for name in names]
    return markdown_table(["", *heads], lines)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    several = commands.add_parser("run", help="train what the table lacks")
    several.add_argument("--arms", nargs="+", choices=ARMS, default=[*ARMS])
    several.add_argument("--seeds", type=int, default=5)
    several.add_argument("--steps", type=int, default=1_000_000)
    several.add_argument("--processes", type=int, default=1, help="runs at a time")
    logs = commands.add_parser("logs", help="add rows of the authors' logs")
    logs.add_argument("files", nargs="+", type=Path)
    commands.add_parser("table", help="print the table")
    one = commands.add_parser("one", help="train once and print the row")
    one.add_argument("arm", choices=ARMS)
    one.add_argument("seed", type=int)
    one.add_argument("steps", type=int)
    given = parser.parse_args()
    if given.command == "one":
        print(json.dumps(train_one(given.arm, given.seed, given.steps)))
    elif given.command == "run":
        FAMILIES["crafter_symbols"].tasks()  # refuses if its packages are not there
        seeds = product(range(given.seeds), given.arms)
        every = [{"arm": arm, "seed": str(seed), "steps": str(given.steps)} for seed, arm in seeds]
        add_rows(ROWS, every, partial(in_process, "benchmarks.arena.crafter_arms", "one"), given.processes)
    elif given.command == "logs":
        found = [row for path in given.files for row in logged_rows(path)]
        identities = [{name: row.pop(name) for name in ("arm", "seed", "steps")} for row in found]
        add_rows(ROWS, identities, lambda **identity: found[identities.index(identity)])
    else:
        print(table())
    return 0


if __name__ == "__main__":
    run(main)
