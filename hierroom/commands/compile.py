"""Compile every kernel ahead of its first use: ``python -m hierroom compile``."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from hierroom.support.cli import read_arguments
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.reading import read_json

PACKAGE = Path(__file__).parents[1]
STAMP = "hierroom-compiled.json"


@dataclass(frozen=True)
class CompileArguments:
    """Compile all kernels now, so that nothing waits for it later; what is compiled already is left as it is.

    The compiled code is kept on disk, for this machine's processor and this version of Numba.
    """


def main(argv: Sequence[str]) -> int:
    """Run the command on its words."""
    read_arguments(CompileArguments, "compile", argv)
    from numba.core import config

    from hierroom.support.compile.kernel_folder import kernel_folder

    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError("NUMBA_DISABLE_JIT is set, so there is nothing to compile; unset it")
    started = time.perf_counter()
    folder = kernel_folder()
    if folder is None:
        raise InputError("there is no folder to keep compiled code in; set NUMBA_CACHE_DIR to one that can be written")
    stamp = Path(folder) / STAMP
    n_compiled = 0
    if not _is_complete(stamp):
        n_compiled = compile_all(Console(stderr=True))
        files = [str(path) for path in sorted(stamp.parent.rglob("*.nb[ci]"))]
        write_atomically(stamp, json.dumps({"made_of": _made_of(), "files": files}))
    seconds = f"{time.perf_counter() - started:.1f} s"
    done = f"{n_compiled} kernels compiled in {seconds}"
    print(done if n_compiled else f"all kernels are compiled already ({seconds})")
    return 0


def compile_all(console: Console) -> int:
    """Use every kernel once in each way it is used, with a progress bar; return how many were compiled."""
    import torch
    from numba.core import event

    from hierroom.support.compile.clock import COMPILE_EVENT, compile_clock, compiling
    from hierroom.support.compile.kernel import KERNELS

    torch.set_num_threads(1)  # as in training
    compile_clock().is_notice_due = False  # the bar says it
    columns = (TextColumn("compiling kernels"), BarColumn(), TextColumn("{task.fields[status]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None, status="loading PyTorch")
        plays = list(_plays())  # they load all kernels
        bar.update(task, total=len(KERNELS))

        class Advance(event.Listener):
            def on_start(self, event: event.Event) -> None:
                kernel, n_done = compiling(event), sum(bool(kernel.signatures) for kernel in KERNELS)
                if kernel in KERNELS:  # not what Numba brings along
                    bar.update(task, completed=n_done, status=f"{n_done} of {len(KERNELS)}, {kernel.__name__}")

            def on_end(self, event: event.Event) -> None:
                pass

        with event.install_listener(COMPILE_EVENT, Advance()):
            for play in plays:
                play()
    return sum(bool(kernel.stats.cache_misses) for kernel in KERNELS)


def _plays() -> Iterator[Callable[[], object]]:
    """Yield short uses of the package that together call the kernels with all types of arguments they ever get."""
    import numpy as np

    import hierroom
    from hierroom.complexity.measures import sampled_cover_time
    from hierroom.complexity.measures.table import measure_graphs
    from hierroom.complexity.report import analyze
    from hierroom.gym_env import EscapeRoom
    from hierroom.lab.measure import measure_named
    from hierroom.learners.config import PPOConfig
    from hierroom.runs.trainer import Trainer
    from hierroom.turns.rewards import REWARDS
    from hierroom.vector_env import EscapeRooms
    from hierroom.worlds.escape_room.engine import Engine
    from hierroom.worlds.escape_room.features import FEATURES
    from hierroom.worlds.escape_room.measured_levels import measure_levels
    from hierroom.worlds.escape_room.sampled_level import SampledLevel
    from hierroom.worlds.workshop.task import workshop_of

    small: Mapping[str, Any] = {"graph": "d", "size": 11, "max_steps": 30}
    graph_a = hierroom.GoalGraph.named("a")

    def train(**entries: Any) -> None:
        config = hierroom.find_preset(entries.pop("preset", "default"))
        short = {"num_envs": 4, "sequence_length": 8, "evaluation_episodes": 4, "meta_start_success": 0.0}
        meta_ppo = PPOConfig(sequence_length=2, minibatches=2, sequences_per_update=4)
        base = {} if "task" in entries else small
        trainer = Trainer(config.changed(**{**base, **short, "meta_ppo": meta_ppo, **entries}))
        for _ in range(12 if entries.get("meta") == "learned" else 2):
            trainer.advance()
        trainer.evaluate()
        trainer.turns.set_state(trainer.turns.get_state())  # as a run that goes on does

    def play(env: Any) -> None:
        env.reset(seed=0)
        env.render()
        for _ in range(60):
            ended = any(env.last()[2:4])
            env.step(None if ended else 0)
            if not env.agents:
                env.reset()

    def step(env: Any, n: int | None) -> None:
        env.reset(seed=0)
        for _ in range(60):
            ended = env.step(0 if n is None else np.zeros(n, int))[2:4]
            if n is None and any(ended):
                env.reset()

    yield train
    for method in ("ppo", "ppo-novelty", "ppo-rnd"):
        yield partial(train, method=method)
    yield partial(train, preset="learned", meta="learned")
    yield partial(train, preset="paper", drop_key=True)
    yield partial(train, graph=("a", "c"), curriculum_stages=2)
    yield partial(train, meta="oracle", reward="bonus", features=(*FEATURES.keys() - {"goal-outcome"},))
    yield partial(measure_named, "random", {"graph": "a"}, False, 4, 0)
    yield analyze("a").goal_sensitivity
    yield partial(measure_levels, [graph_a], 1, 60)
    few: Mapping[str, int] = {"episodes": 2, "n_policies": 2, "policy_episodes": 2, "gorp_runs": 2, "max_steps": 0}
    yield partial(SampledLevel(Engine([graph_a]).state, 60).measure, **few)
    yield partial(measure_graphs, [graph_a], 20)
    yield partial(sampled_cover_time, np.eye(2)[::-1], 0, 2)
    yield lambda: list(hierroom.rollout("oracle", hierroom.EnvConfig(**small), episodes=4))
    for mask, reward in zip(("reachable", "existing", "seen", "none"), REWARDS, strict=True):
        yield partial(play, hierroom.env(**small, goal_mask=mask, reward=reward, render_mode="rgb_array"))
    shop: Mapping[str, Any] = {"task": "workshop:2", "max_steps": 30}
    yield partial(train, **shop, method="ppo-novelty")
    yield partial(train, **shop, preset="learned", meta="learned", features=(*workshop_of("2").features,))
    yield partial(step, EscapeRoom(**shop, meta="fixed-dfs"), None)
    yield partial(step, EscapeRooms(4, **shop, meta="oracle", flat=True), 4)
    pole = hierroom.Task("CartPole-v1", {"left": lambda env, info: env.unwrapped.state[0] < 0}, target="left")
    yield partial(train, task=pole, meta="random", max_steps=30)
    yield partial(step, EscapeRoom(**small, meta="random"), None)
    yield partial(step, EscapeRooms(4, **small, autoreset_mode="SameStep"), 4)
    yield partial(step, EscapeRooms(4, **small, flat=True), 4)
    yield partial(step, EscapeRooms(4, **small, autoreset_mode="NextStep", copy=False), 4)
    yield partial(step, EscapeRooms(4, layout="######\n#@rRE#\n######", max_steps=30, autoreset_mode="SameStep"), 4)


def _is_complete(stamp: Path) -> bool:
    """Return whether the command has compiled all of this source, and every file that it left is still there."""
    try:
        written = read_json(stamp)
        files = [Path(file) for file in written["files"]]
        return written["made_of"] == _made_of() and bool(files) and all(file.exists() for file in files)
    except (InputError, TypeError, KeyError):
        return False


def _made_of() -> str:
    """Return a digest of all that decides what is compiled."""
    import numba
    from llvmlite import binding

    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.read_bytes())
    machine = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    digest.update(repr((PACKAGE, platform.python_version(), numba.__version__, *machine)).encode())
    return digest.hexdigest()
