"""Memory, threads, open files and speed over an hour of everything together, in one process.

    python -m benchmarks.soak                # an hour
    python -m benchmarks.soak --minutes 3    # a look

A round makes environments of every API, resets them, steps at random, renders and closes them. It goes on with two long
trainings (HiPPO with a learned meta-controller, and curiosity) and saves and reads their checkpoints. Every tenth round
takes a short run of two threads from `hierroom.train` to its pictures, loads it and plays. Each tenth of the time is a
row: mean memory, the largest number of threads and of open files, and medians of speed. On a shared machine, seconds
depend on other processes, and CPU time on the clock of a core. So the same piece of work is timed before and after each
part of a round. Speed is judged by the steps taken in the CPU time of one such piece. Steps a second and a CPU second
are printed too. Exit code 1 if from the second tenth to the last memory grew by more than 5%, a thread or a file was
added, or a speed fell by more than a tenth.
"""

from __future__ import annotations

import contextlib
import gc
import io
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import torch
import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

import hierroom
from hierroom.runs.config.presets import find_preset
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer

N_ROWS = 10
MAX_GROWTH, MAX_SLOWDOWN = 0.05, 0.1
STEPS, VECTOR_STEPS, UPDATES, ROUNDS_PER_RUN = 300, 60, 2, 10
NAMES, UNITS = ("API", "training"), ("s", "CPU s", "piece")


@dataclass(frozen=True)
class Options:
    """Play and train for a while, and look whether memory, threads, open files or speed change.

    Args:
        minutes: how long.
    """

    minutes: float = 60.0


@dataclass(frozen=True)
class Speed:
    """Speed of one part of a round, in steps."""

    per_second: float
    per_cpu_second: float
    per_piece: float
    """In the CPU time of one `fixed_piece` of work."""


@dataclass(frozen=True)
class Sample:
    """Measurements of one round."""

    seconds: float
    """Since the start."""
    memory: float
    """Resident and its own, in MiB: how much of files stays in memory is up to the kernel."""
    threads: int
    files: int
    api: Speed
    """Of steps in the environments."""
    train: Speed
    """Of steps of training."""


def fixed_piece() -> float:
    """CPU seconds of always the same work, none of it this package's: Python, and arrays larger than a cache."""
    started, counts = time.process_time(), {}
    for n in range(60_000):
        counts[n % 1000] = counts.get(n % 1000, 0) + n
    numbers = np.arange(200_000, dtype=np.float32)
    for _ in range(10):
        numbers = np.sort(numbers[::-1] * np.float32(1.0001))
    return time.process_time() - started


def timed(part: Callable[[], int]) -> tuple[int, Speed]:
    """Return the steps that a part of a round takes, and how fast it is."""
    piece = fixed_piece()
    wall, cpu = time.monotonic(), time.process_time()
    n_steps = part()
    wall, cpu = time.monotonic() - wall, time.process_time() - cpu
    piece = (piece + fixed_piece()) / 2
    return n_steps, Speed(n_steps / wall, n_steps / cpu, n_steps / cpu * piece)


def play_apis(seed: int) -> int:
    """Make, reset, step, render and close an environment of every API; returns the number of steps."""
    rng = np.random.default_rng(seed)
    aec = hierroom.env(graph="f", render_mode="rgb_array")
    aec.reset(seed=seed)
    for n, _ in enumerate(aec.agent_iter(STEPS)):
        observation, _, termination, truncation, _ = aec.last()
        has_ended = termination or truncation
        aec.step(None if has_ended else int(rng.choice(np.flatnonzero(observation["action_mask"]))))
        if n % 50 == 0:
            aec.render()
    aec.close()
    parallel = hierroom.add_features(hierroom.parallel_env(graph="rooms:3", max_steps=50), ["goal-place"])
    boxes = hierroom.box_view(hierroom.parallel_env(graph="c", max_steps=50))
    for env in (parallel, boxes):
        for n in range(STEPS):
            if not env.agents:
                env.reset(seed=seed + n)
            env.step({agent: int(rng.integers(env.action_space(agent).n)) for agent in env.agents})
        env.close()
    single = gymnasium.make("hierroom/EscapeRoom-c-v0", render_mode="ansi")
    minigrid = hierroom.minigrid_view(gymnasium.make("hierroom/EscapeRoom-d-v0", render_mode="rgb_array"))
    for env in (single, minigrid):
        has_ended = True
        for n in range(STEPS):
            if has_ended:
                env.reset(seed=seed + n)
            *_, terminated, truncated, _ = env.step(int(rng.integers(3)))
            has_ended = terminated or truncated
            if n % 50 == 0:
                env.render()
        env.close()
    n_vector = 0
    for num_envs, threads in ((16, 1), (1024, 2)):
        envs = gymnasium.make_vec("hierroom/EscapeRoom-g-v0", num_envs=num_envs, threads=threads, meta="random")
        envs.reset(seed=seed)
        for _ in range(VECTOR_STEPS):
            envs.step(rng.integers(5, size=num_envs))
        envs.close()
        n_vector += VECTOR_STEPS * num_envs
    return 5 * STEPS + n_vector


def train_on(trainer: Trainer, folder: RunFolder) -> int:
    """Take some updates, write what a run writes, read the checkpoint again; returns the number of steps."""
    before = trainer.steps
    for _ in range(UPDATES):
        trainer.advance()
        folder.metrics.append([trainer.metrics()])
    path = folder.save_checkpoint(trainer.state_dict())
    trainer.load_state_dict(folder.load_checkpoint())
    path.unlink()
    return trainer.steps - before


def short_run(path: Path, seed: int) -> None:
    """Train a run of its own from the start to its pictures, load it and play."""
    with contextlib.redirect_stdout(io.StringIO()):
        sizes = {"size": 11, "num_envs": 16, "steps": 8_000, "evaluations": 2, "evaluation_episodes": 20}
        hierroom.train(graph="a", **sizes, threads=2, seed=seed, out=path)
    for _ in hierroom.rollout(hierroom.load(path), episodes=20):
        pass


def sample(started: float, api: Speed, train: Speed) -> Sample:
    """Measure this process now; collected garbage does not count."""
    gc.collect()
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines())
    memory = int(status["RssAnon"].split()[0]) / 2**10
    files = len(os.listdir("/proc/self/fd")) - 1  # the listing itself has one open
    return Sample(time.monotonic() - started, memory, int(status["Threads"]), files, api, train)


def rows(samples: list[Sample], seconds: float) -> list[Sample]:
    """Return a row for each tenth of the time: mean memory, the most threads and files, and medians of speed."""
    parts = [[s for s in samples if int(N_ROWS * s.seconds / seconds) == n] for n in range(N_ROWS)]
    parts[-1] += [s for s in samples if s.seconds >= seconds]
    return [
        Sample(
            part[-1].seconds,
            float(np.mean([s.memory for s in part])),
            max(s.threads for s in part),
            max(s.files for s in part),
            median_speed([s.api for s in part]),
            median_speed([s.train for s in part]),
        )
        for part in parts
        if part
    ]


def median_speed(speeds: list[Speed]) -> Speed:
    """Return the median of each number."""
    return Speed(*np.median([astuple(speed) for speed in speeds], axis=0).tolist())


def problems(found: list[Sample]) -> list[str]:
    """Return what grew or slowed down from the second row to the last; the first row warms up."""
    first, last = found[1 if len(found) > 1 else 0], found[-1]
    grown = []
    if last.memory > first.memory * (1 + MAX_GROWTH):
        grown.append(f"memory grew from {first.memory:.0f} to {last.memory:.0f} MiB")
    for name in ("threads", "files"):
        if getattr(last, name) > getattr(first, name):
            grown.append(f"{name} grew from {getattr(first, name)} to {getattr(last, name)}")
    for name in ("api", "train"):
        before, now = getattr(first, name).per_piece, getattr(last, name).per_piece
        if now < before * (1 - MAX_SLOWDOWN):
            grown.append(f"speed of {name} fell from {before:,.0f} to {now:,.0f} steps per piece of work")
    return grown


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    torch.set_num_threads(1)
    console = Console(width=140)
    columns = (TextColumn("{task.percentage:3.0f}%"), BarColumn(), TextColumn("{task.fields[status]}"))
    seconds, samples, n_steps = 60 * options.minutes, [], 0
    with tempfile.TemporaryDirectory() as name, Progress(*columns, TimeRemainingColumn(), console=console) as bar:
        presets = {
            "learned": find_preset("learned").changed(num_envs=32, meta_start_success=0.0),
            "rnd": find_preset("default").changed(method="ppo-rnd", num_envs=32),
        }
        trainings = []
        for run, config in presets.items():
            config = config.changed(graph="f", steps=10**12, threads=1)
            trainings.append((Trainer(config), RunFolder.create(Path(name) / run, config)))
        task = bar.add_task("", total=seconds, status="the first round compiles,")
        started, rounds = time.monotonic(), 0
        while rounds < 2 or time.monotonic() - started < seconds:  # the first compiles, and is no sample
            if rounds % ROUNDS_PER_RUN == 0:
                path = Path(name) / f"short-{rounds}"
                short_run(path, rounds)
            n_api, api = timed(partial(play_apis, rounds))
            n_train, train = timed(lambda: sum(train_on(*training) for training in trainings))
            n_steps += n_api + n_train
            rounds += 1
            if rounds > 1:
                samples.append(sample(started, api, train))
                status = f"{samples[-1].memory:,.0f} MiB, {samples[-1].threads} threads, {samples[-1].files} files,"
                bar.update(task, completed=min(samples[-1].seconds, seconds), status=status)
    table = Table("minutes", "memory [MiB]", "threads", "files", *(f"{n} steps / {u}" for n in NAMES for u in UNITS))
    for row in rows(samples, seconds):
        speeds = [f"{number:,.0f}" for speed in (row.api, row.train) for number in astuple(speed)]
        table.add_row(f"{row.seconds / 60:.1f}", f"{row.memory:.1f}", str(row.threads), str(row.files), *speeds)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    console.print(f"{os.cpu_count()} cores, {rounds} rounds, {n_steps:,} steps, peak memory {peak:.0f} MiB")
    console.print(table)
    found = problems(rows(samples, seconds))
    console.print("; ".join(found) if found else "nothing grew and nothing slowed down")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
