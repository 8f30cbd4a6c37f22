"""Variants of the paper's method: single steps as the network's sequences, and returns that go on beyond a goal."""

from pathlib import Path

import gymnasium
import numpy as np
import torch

from benchmarks import variants
from hierroom.lab.sweep.plan import read_plan
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.worlds.escape_room.constants import DROP, FORWARD, LEFT, PICKUP, RIGHT

ROOT = Path(__file__).parents[2]


def test_plain_lstm_sequence_equals_single_steps():
    torch.manual_seed(0)
    space = AgentSpace((22,) * 49 + (4, 7), 5)
    network, generator = variants.PlainLSTM(space, 16), torch.Generator().manual_seed(1)
    top = torch.tensor(space.cardinalities)
    features = (torch.rand(6, 3, 51, generator=generator) * top).to(torch.uint8)
    resets = torch.rand(6, 3, generator=generator) < 0.3
    first = torch.randn(3, 32, generator=generator)
    state, steps = first, []
    for t in range(6):
        logits, values, state = network.step(features[t], state * ~resets[t, :, None])
        steps.append((logits, values))
    logits, values = network.sequence(features, first, resets)
    torch.testing.assert_close(logits, torch.stack([one[0] for one in steps]))
    torch.testing.assert_close(values, torch.stack([one[1] for one in steps]))


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
