"""Compilation is timed separately: only the seconds in which Numba compiles count."""

import time

import numpy as np
import pytest
from numba import njit

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.clocks import compile_clock


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
