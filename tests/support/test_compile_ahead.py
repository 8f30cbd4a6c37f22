"""After ``python -m hierroom compile`` nothing compiles any more; what compiles is timed separately."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
from children import run_python
from numba import njit

from hierroom.commands import compile
from hierroom.commands.compile import is_complete
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.kernel import compile_clock, kernel_folder

LATER = """
import numpy as np
import hierroom
from hierroom.commands.compile import play_as_trained, play_in_worlds, play_with_learners
from hierroom.support.kernel import compile_clock
from hierroom.support.kernel import KERNELS

pole = hierroom.Task("CartPole-v1", {"left": lambda env, info: env.unwrapped.state[0] < 0}, target="left")
clock = compile_clock()
for play in (play_in_worlds, play_with_learners, play_as_trained):
    play()
print(clock.seconds)
called = {kernel: {*kernel.signatures} for kernel in KERNELS}
for entries in (
    {"preset": "learned", "graph": ("b", "e"), "max_steps": 90},
    {"preset": "long", "method": "ppo-bonus", "drop_key": True},
    {"preset": "large", "size": 31, "method": "ppo-sketch", "goal_mask": "seen", "subgoal_horizon": 7, "threads": 1},
    {"task": "workshop:4:1", "goal_mask": "existing"},
    {"task": pole, "max_steps": 50},
):
    trainer = hierroom.train(num_envs=5, steps=500, evaluations=1, evaluation_episodes=3, **entries)
    list(hierroom.rollout(trainer, episodes=2))
env = hierroom.parallel_env(task="workshop:3", render_mode="rgb_array", reward="bonus")
env.reset(seed=1)
env.step({agent: 1 for agent in env.agents})
env.render()
env = hierroom.parallel_env(graph="g", render_mode="rgb_array", reward="novelty")
env.reset(seed=1)
env.step({agent: 1 for agent in env.agents})
env.render()
hierroom.add_features(hierroom.raw_env(graph="b"), ["view", "frontier-places"]).reset(seed=2)
print(sum(len({*kernel.signatures} - called[kernel]) for kernel in KERNELS), clock.seconds)
"""


@pytest.fixture(scope="module")
def compiled():
    """Everything is compiled, into the cache that all tests use."""
    done = run_python("-m", "hierroom", "compile")
    assert done.returncode == 0, done.stderr
    return Path(kernel_folder())


@pytest.mark.slow
def test_second_compile_ends_without_importing_torch(compiled):
    assert is_complete(compiled)
    done = run_python("-X", "importtime", "-m", "hierroom", "compile")
    assert done.stdout.startswith("all kernels are compiled already")
    assert not any(line.endswith(" torch") for line in done.stderr.splitlines())


def test_no_kernel_contains_code_that_prints_shapes(compiled):
    """Numba generates it for ``target[:] = source``, with all of Python's strings, in seconds: see `copy_matrix`."""
    kernels = [*compiled.rglob("*.nbc")]
    assert len(kernels) > 100
    assert not [path.name for path in kernels if b"raise_with_shape_context" in path.read_bytes()]


def test_deleted_or_outdated_kernels_are_not_complete(compiled, tmp_path, monkeypatch):
    one, another = (tmp_path / f"kernels.{name}.nbc" for name in ("advance", "look"))
    one.touch()
    (tmp_path / f"complete-1-{compile._digest()}").touch()
    assert is_complete(tmp_path)
    another.touch()  # of a run with other types
    assert is_complete(tmp_path)
    with monkeypatch.context() as changed:
        changed.setattr(compile, "PACKAGE", compile.PACKAGE / "goals")
        assert not is_complete(tmp_path)
    one.unlink()
    another.unlink()
    assert not is_complete(tmp_path)


@pytest.mark.slow
def test_later_runs_compile_no_new_signature(compiled, tmp_path):
    """By the kernels' signatures: the cache of these tests may hold more than the command has compiled."""
    paths = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}}
    done = run_python("-c", LATER, **paths)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert (lines[0], lines[-1]) == ("0.0", "0 0.0")


def test_compile_with_disabled_jit_exits_with_an_error():
    done = run_python("-m", "hierroom", "compile", env={**os.environ, "NUMBA_DISABLE_JIT": "1"})
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: NUMBA_DISABLE_JIT is set, so there is nothing to compile; unset it\n"


def test_compile_clock_runs_only_while_numba_compiles():
    @njit
    def inner(x):
        return x + 1

    @njit
    def outer(x):
        return inner(x) * 2

    clock, before = compile_clock(), compile_clock().seconds
    started = time.perf_counter()
    assert outer(3) == 8
    elapsed = time.perf_counter() - started
    compiled = clock.seconds - before
    assert 0.2 * elapsed < compiled <= elapsed  # the inner function is compiled within the outer one, and counted once
    assert outer(4) == 10
    time.sleep(0.01)
    assert clock.seconds - before == compiled


@pytest.mark.slow
def test_compile_seconds_are_no_training_seconds(monkeypatch):
    trainer = Trainer(TrainConfig(num_envs=4, steps=2000).changed(graph="a", size=11))
    trainer.advance()
    act = trainer.controller.act

    @njit
    def slow(x):
        return np.sort(x)[::-1] + x.sum()

    def compiling(observation):
        slow(np.arange(3.0))
        return act(observation)

    monkeypatch.setattr(trainer.controller, "act", compiling)
    seconds, compiled, started = trainer.seconds, trainer.compile_seconds, time.perf_counter()
    trainer.advance()
    elapsed = time.perf_counter() - started
    assert trainer.compile_seconds - compiled > 0.05
    assert trainer.seconds - seconds + trainer.compile_seconds - compiled <= elapsed
