"""Compile every kernel ahead of its first use: ``python -m hierroom compile``."""

from __future__ import annotations

import gc
import hashlib
import platform
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

from hierroom.support.cli import read_arguments
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.output import said_when_slow

PACKAGE = Path(__file__).parents[1]
LEARNERS = f"""
import gc, sys
gc.disable()
sys.path.insert(0, {str(PACKAGE.parent)!r})
from hierroom.commands.compile import play_with_learners
play_with_learners()
"""
"""The program of the second process."""


@dataclass(frozen=True)
class CompileArguments:
    """Compile all kernels now, so that no command waits for it later; kernels that are compiled already are kept.

    The compiled code is kept on disk, for this machine's processor and this version of Numba.
    """


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    read_arguments(CompileArguments, "compile", argv)
    from numba.core import config

    from hierroom.support.kernel import kernel_folder

    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError("NUMBA_DISABLE_JIT is set, so there is nothing to compile; unset it")
    folder = kernel_folder()
    if folder is None:
        raise InputError("there is no folder to keep compiled code in; set NUMBA_CACHE_DIR to one that can be written")
    started = time.perf_counter()
    n_new = 0 if is_complete(Path(folder)) else compile_all(Path(folder))
    stamp = Path(folder, f"complete-{n_kernels(Path(folder))}-{_digest()}")
    write_atomically(stamp, "complete")  # which fails on a full disk, where kernels are not kept
    seconds = f"{time.perf_counter() - started:.1f} s"
    print(f"{n_new} kernels compiled in {seconds}" if n_new else f"all kernels are compiled already ({seconds})")
    return 0


def compile_all(folder: Path) -> int:
    """Call every kernel with all types of arguments that it gets, in two processes; return how many were compiled.

    In the end, this process calls all of them and loads from ``folder`` those that the other process has compiled.
    """
    from hierroom.support.kernel import compile_clock

    before = n_kernels(folder)
    compile_clock().may_speak = False  # the line below says more
    gc.disable()  # with Numba's many objects it takes a tenth of the time
    nowhere = subprocess.DEVNULL
    child = subprocess.Popen([sys.executable, "-c", LEARNERS], stdin=nowhere, stdout=nowhere, stderr=nowhere)
    try:
        with said_when_slow(lambda: f"compiling kernels: {n_kernels(folder) - before} so far"):
            play_in_worlds()
            child.wait()
            play_with_learners()
            play_as_trained()
    finally:
        gc.enable()
        child.kill()  # has no effect if it has ended
        child.wait()
    return n_kernels(folder) - before


def is_complete(folder: Path) -> bool:
    """Return whether a folder has as many kernels as when all were compiled; a run may have added others of its own."""
    stamps = folder.glob(f"complete-*-{_digest()}")
    return any(int(one.name.split("-")[1]) <= n_kernels(folder) for one in stamps)


def n_kernels(folder: Path) -> int:
    """Return the number of kernels in a folder, counting each signature of a kernel."""
    return len([*folder.rglob("*.nbc")])


SMALL: Mapping[str, Any] = {"graph": "d", "size": 11, "max_steps": 30}
SHOP: Mapping[str, Any] = {"task": "workshop:2", "max_steps": 30}


def play_in_worlds() -> None:
    """Use the kernels of the worlds and the turns, which need no learner."""
    import hierroom
    from hierroom.gym_env import EscapeRoom
    from hierroom.turns.rewards import REWARDS
    from hierroom.vector_env import EscapeRooms

    def play(env: Any) -> None:
        env.reset(seed=0)
        env.render()
        for _ in range(60):
            ended = any(env.last()[2:4])
            env.step(None if ended else 0)
            if not env.agents:
                env.reset()

    for mask, reward in zip(cycle(("reachable", "existing", "seen", "none")), REWARDS, strict=False):
        play(hierroom.env(**SMALL, goal_mask=mask, reward=reward, render_mode="rgb_array"))
    _step(EscapeRoom(**SMALL, meta="random"), None)
    _step(EscapeRooms(4, **SMALL, autoreset_mode="SameStep"), 4)
    _step(EscapeRooms(4, **SMALL, autoreset_mode="NextStep", copy=False), 4)
    _step(EscapeRooms(4, layout="######\n#@rRE#\n######", max_steps=30, autoreset_mode="SameStep"), 4)


def play_with_learners() -> None:
    """Use the kernels of learners, of chains and of the Workshop."""
    import hierroom
    from hierroom.complexity.report import analyze
    from hierroom.gym_env import EscapeRoom
    from hierroom.vector_env import EscapeRooms
    from hierroom.worlds.workshop.task import workshop_of

    pole = hierroom.Task("CartPole-v1", {"left": lambda env, info: env.unwrapped.state[0] < 0}, target="left")
    taxi = hierroom.Task("Taxi-v4", {"hired": lambda env, info: env.unwrapped.s // 4 % 5 == 4}, target="hired")
    _train(task=pole, meta="random", max_steps=30)
    for task in (pole, taxi):  # numbers, and categories with more values than a byte
        _train(task=task, preset="task", meta="random", max_steps=30)
    analyze("a").goal_sensitivity()
    _train(**SHOP, method="ppo")
    _train(**SHOP, preset="learned", meta="learned", features=(*workshop_of("2").features,))
    _step(EscapeRoom(**SHOP, meta="fixed-dfs"), None)
    _step(EscapeRooms(4, **SHOP, meta="oracle"), 4)


def play_as_trained() -> None:
    """Use the kernels of learning in EscapeRooms, of rollouts and replays."""
    import numpy as np

    import hierroom
    from hierroom.worlds.escape_room.features import FEATURES
    from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS
    from hierroom.worlds.escape_room.rooms import rooms_of

    _train()
    for method in ("ppo", "ppo-novelty", "ppo-rnd"):
        _train(method=method)
    _train(preset="learned", meta="learned")
    _train(preset="paper", drop_key=True)
    _train(graph=("a", "c"), curriculum_stages=2)
    _train(meta="oracle", reward="bonus", features=(*FEATURES.keys() - {"goal-outcome"},))
    list(hierroom.rollout("oracle", hierroom.EnvConfig(**SMALL), episodes=4))
    rooms_of(np.zeros(1, LEVEL), NO_MAPS)


def _train(**entries: Any) -> None:
    import torch

    import hierroom
    from hierroom.learners.config import PPOConfig
    from hierroom.runs.trainer import Trainer

    torch.set_num_threads(1)  # as in training
    config = hierroom.find_preset(entries.pop("preset", "default"))
    short = {"num_envs": 4, "sequence_length": 8, "evaluation_episodes": 4, "meta_start_success": 0.0}
    meta_ppo = PPOConfig(sequence_length=2, minibatches=2, sequences_per_update=4)
    base = {} if "task" in entries else SMALL
    trainer = Trainer(config.changed(**{**base, **short, "meta_ppo": meta_ppo, **entries}))
    for _ in range(12 if entries.get("meta") == "learned" else 2):
        trainer.advance()
    trainer.evaluate()
    trainer.turns.set_state(trainer.turns.get_state())  # as a resumed run does


def _step(env: Any, n: int | None) -> None:
    import numpy as np

    env.reset(seed=0)
    for _ in range(60):
        ended = env.step(0 if n is None else np.zeros(n, int))[2:4]
        if n is None and any(ended):
            env.reset()


def _digest() -> str:
    """Return a digest of all that determines which kernels there are, and their compiled code."""
    import numba
    from llvmlite import binding

    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.read_bytes())
    machine = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    digest.update(repr((platform.python_version(), numba.__version__, *machine)).encode())
    return digest.hexdigest()[:16]
