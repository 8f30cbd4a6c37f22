"""Our learner, Stable-Baselines3's PPO and sb3-contrib's RecurrentPPO on tasks that nobody here wrote.

    python -m benchmarks.others run --seeds 3          # the rows that are lacking, one after the other
    python -m benchmarks.others table                  # docs/others.md shows it

Equal steps and equal ends of episodes. Ours has one preset for all tasks, the others have settings like RL Zoo's for
each, and one-hot inputs where observations are categories. The score is the mean return, or share of successes, of the
last 100 training episodes; thresholds and steps were fixed before the first row.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd

import hierroom
from benchmarks.other_tasks import METHODS, TASKS, Other
from hierroom.support.tables import markdown_table

ROWS = Path(__file__).parent / "results" / "others.csv"
LAST = 100
"""Episodes of a mean."""
RESAMPLES = 10_000
OTHERS = ("ppo", "recurrent-ppo")


@dataclass(frozen=True)
class Row:
    """Hold what a run measured; ``reached`` are the steps to the threshold, NaN if it was not reached."""

    task: str
    method: str
    seed: int
    steps: int
    reached: float
    score: float
    cpu_seconds: float


def measure(name: str, method: str, seed: int) -> Row:
    """Train once, and return the row."""
    task = TASKS[name]
    begun = time.process_time()
    steps, returns = (_ours if method in ("hierroom", "hippo") else _theirs)(task, method, seed)
    seconds = time.process_time() - begun
    scores = pd.Series(task.score(returns), index=steps)
    means = scores.rolling(LAST).mean()
    reached = means.index[means >= task.threshold]
    last = float(scores.iloc[-LAST:].mean())
    return Row(name, method, seed, task.steps, float(reached[0]) if len(reached) else np.nan, last, seconds)


def _ours(task: Other, method: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    own = hierroom.Task(make=task.make, label=task.id, action_mask="")  # nobody else gets Taxi's
    if method == "hippo":
        assert task.goals is not None
        goals = task.goals()
        rules = {name: {"needs": before} for before, name in pairwise(goals)}
        own = replace(own, goals=goals, rules={next(iter(goals)): {}, **rules}, target=[*goals][-1])
    sys.modules[__name__].__dict__["own"] = own  # a task is named by the module that holds it
    with tempfile.TemporaryDirectory() as folder:
        settings = {"steps": task.steps, "evaluations": 0, "film": False, "threads": 1}
        settings |= {"seed": seed, "quiet": True, "log": "none", "method": "ppo" if method == "hierroom" else method}
        hierroom.train(task=own, out=Path(folder) / "run", **settings)
        rows = pd.read_csv(Path(folder) / "run" / "episodes.csv")
    return rows["steps"].to_numpy(), rows["return"].to_numpy(float)


def _theirs(task: Other, method: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    import torch
    from sb3_contrib import RecurrentPPO
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import VecNormalize

    torch.set_num_threads(1)
    settings = {"gamma": 0.99, **task.settings}
    envs = make_vec_env(lambda: _flat(task.make()), settings.pop("num_envs", 8), seed=seed)
    if settings.pop("normalize", False):
        envs = VecNormalize(envs, gamma=settings["gamma"])
    if method == "ppo":
        model = PPO("MlpPolicy", envs, seed=seed, device="cpu", **settings)
    else:
        settings["policy_kwargs"] = {"lstm_hidden_size": 64, **settings.get("policy_kwargs", {})}
        model = RecurrentPPO("MlpLstmPolicy", envs, seed=seed, device="cpu", **settings)
    episodes: list[tuple[int, float]] = []

    def collect(local: Mapping[str, Any], _: Any) -> bool:
        ended = (info["episode"]["r"] for info in local["infos"] if "episode" in info)
        episodes.extend((model.num_timesteps, float(one)) for one in ended)
        return True

    model.learn(task.steps, callback=collect)
    steps, returns = zip(*episodes, strict=True)
    return np.array(steps), np.array(returns)


def _flat(env: gymnasium.Env) -> gymnasium.Env:
    space = env.observation_space
    if not isinstance(space, gymnasium.spaces.Dict):
        return env
    if "image" not in space.spaces:
        return gymnasium.wrappers.FlattenObservation(env)
    from minigrid.core.constants import COLOR_TO_IDX, OBJECT_TO_IDX, STATE_TO_IDX

    sizes = len(OBJECT_TO_IDX), len(COLOR_TO_IDX), len(STATE_TO_IDX)
    n = int(np.prod(space["image"].shape[:2])) * sum(sizes) + 4  # pyright: ignore[reportOptionalSubscript]
    tables = [np.eye(size, dtype=np.float32) for size in sizes]

    def flat(observation: Mapping[str, Any]) -> np.ndarray:
        image = observation["image"].reshape(-1, 3)
        cells = [table[image[:, channel]].ravel() for channel, table in enumerate(tables)]
        return np.concatenate([*cells, np.eye(4, dtype=np.float32)[observation["direction"]]])

    return gymnasium.wrappers.TransformObservation(env, flat, gymnasium.spaces.Box(0, 1, (n,), np.float32))


def run(tasks: list[str], methods: list[str], seeds: int) -> None:
    """Train what the table lacks, each run in a process of its own, and write its row."""
    for seed, name, method in (
        (s, t, m) for s in range(seeds) for t in tasks for m in methods if m in TASKS[t].methods
    ):
        done = pd.read_csv(ROWS) if ROWS.exists() else pd.DataFrame(columns=[*Row.__annotations__])
        if ((done.task == name) & (done.method == method) & (done.seed == seed)).any():
            continue
        command = [sys.executable, "-m", "benchmarks.others", "one", name, method, str(seed)]
        row = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])
        pd.DataFrame([row]).to_csv(ROWS, mode="a", header=not ROWS.exists(), index=False)
        print(*row.values(), flush=True)


def ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Return for each task the median steps of each method, and ours over the better one of the others'."""
    # A run that did not reach the threshold counts with its own steps: its ratio is a bound.
    steps = rows.assign(reached=rows.reached.fillna(rows.steps)).pivot_table(
        index="task", columns="method", values="reached", aggfunc="median", sort=False
    )
    steps = steps.reindex([name for name in TASKS if name in steps.index])
    others = steps[[method for method in OTHERS if method in steps]].min(axis=1)
    return steps.assign(ratio=steps.hierroom / others)


def interval(rows: pd.DataFrame) -> tuple[float, float]:
    """Return the 95% interval of one task's ratio over resampled seeds of each method."""
    random = np.random.default_rng(0)
    medians = {
        method: np.median(random.choice(own.reached.fillna(own.steps), (RESAMPLES, len(own))), axis=1)
        for method, own in rows.groupby("method")
    }
    others = np.min([medians[method] for method in OTHERS if method in medians], axis=0)
    low, high = np.quantile(medians["hierroom"] / others, [0.025, 0.975])
    return float(low), float(high)


def table() -> None:
    """Print the table of docs/others.md."""
    rows = pd.read_csv(ROWS)
    compared, cells = ratios(rows), []
    for name in compared.index:
        line = [name]
        for method in METHODS:
            own = rows[(rows.task == name) & (rows.method == method)]
            if own.empty:
                line.append("-")
                continue
            median = own.reached.fillna(np.inf).median()
            speed = (own.steps / own.cpu_seconds).median()
            steps = f"{median / 1000:.0f}k, " if np.isfinite(median) else ""
            line.append(f"{steps}{own.reached.count()} of {len(own)}; {own.score.mean():.2f}; {speed:,.0f}")
        ratio = compared.ratio[name]
        ends = "" if np.isnan(ratio) else "[{:.2f}, {:.2f}]".format(*interval(rows[rows.task == name]))
        cells.append([*line, f"{ratio:.2f} {ends}" if ends else "-"])
    print(markdown_table(["task", *METHODS, "ratio"], cells))
    flat = rows[rows.method != "hippo"]
    learned = compared[flat.groupby("task").reached.max().reindex(compared.index).notna()].dropna(subset="ratio")
    logs = np.log(learned.ratio)
    resampled = np.random.default_rng(0).choice(logs, (RESAMPLES, len(logs))).mean(1)
    low, high = np.exp(np.quantile(resampled, [0.025, 0.975]))
    print(f"\ngeometric mean of the ratios of {len(logs)} tasks: {np.exp(logs.mean()):.2f} [{low:.2f}, {high:.2f}]")


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    runs = commands.add_parser("run", help="train what the table lacks")
    runs.add_argument("--tasks", nargs="+", choices=TASKS, default=[*TASKS])
    runs.add_argument("--methods", nargs="+", choices=METHODS, default=[*METHODS])
    runs.add_argument("--seeds", type=int, default=10)
    commands.add_parser("table", help="print the table")
    one = commands.add_parser("one", help="train once and print the row")
    one.add_argument("task", choices=TASKS)
    one.add_argument("method", choices=METHODS)
    one.add_argument("seed", type=int)
    given = parser.parse_args()
    if given.command == "one":
        print(json.dumps(asdict(measure(given.task, given.method, given.seed))))
    elif given.command == "run":
        run(given.tasks, given.methods, given.seeds)
    else:
        table()


if __name__ == "__main__":
    main()
