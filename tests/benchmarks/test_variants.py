"""Variants of the paper's method: returns that go on beyond a goal, and the plans of sweeps."""

from pathlib import Path

import gymnasium
import numpy as np

from benchmarks import variants
from hierroom.lab.sweep.plan import read_plan
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, PICKUP, RIGHT

ROOT = Path(__file__).parents[2]


def test_repeated_bonus_pays_only_keys_picked_up_again():
    once, each_time = (
        gymnasium.make_vec("hierroom/EscapeRoom-a-v0", num_envs=16, size=11, drop_key=True, meta="none", reward=reward)
        for reward in ("bonus", variants.RepeatedBonus())
    )
    for envs in (once, each_time):
        envs.reset(seed=0)
    generator, n_again = np.random.default_rng(0), 0
    for _ in range(400):
        actions = generator.choice([FORWARD, LEFT, RIGHT, PICKUP, PICKUP, DROP], 16)
        paid_once, paid = (envs.step(actions)[1] for envs in (once, each_time))
        again = paid != paid_once
        assert (paid[again] == 1).all()
        assert (paid_once[again] == 0).all()
        assert (actions[again] == PICKUP).all()
        n_again += again.sum()
    assert n_again > 0


def test_every_benchmark_sweep_is_a_valid_plan(monkeypatch):
    monkeypatch.chdir(ROOT)
    plans = sorted((ROOT / "benchmarks" / "sweeps").glob("*.toml"))
    assert plans
    for path in plans:
        assert len(read_plan(path).runs()) >= 6, path
