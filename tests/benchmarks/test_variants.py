"""Variants of the paper's method: single steps as the network's sequences, and returns that go on beyond a goal."""

from pathlib import Path

import gymnasium
import numpy as np
import torch
from escape_room import WORLD
from torch import nn

from benchmarks import variants
from hierroom.agents.features import Features
from hierroom.lab.sweep.plan import read_plan
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
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


def test_usual_weights_match_torch_defaults():
    space = AgentSpace(Features(WORLD, ("view-ids", "goal")).cardinalities, 5)
    torch.manual_seed(0)
    network, layers = variants.usual_weights(space, 64), (nn.LSTM(64, 64), nn.Linear(64, 5), nn.Linear(64, 1))
    assert type(network) is RecurrentActorCritic  # which is computed by the compiled kernels
    for ours, theirs in zip((network.core, network.policy_head, network.value_head), layers, strict=True):
        weights, usual = (
            ours.weight,
            dict(theirs.named_parameters()).get("weight", getattr(theirs, "weight_hh_l0", None)),
        )
        assert 0.9 < float((weights.abs().max() / usual.abs().max()).detach()) < 1.1
        bias, usual_bias = ours.bias, dict(theirs.named_parameters()).get("bias", getattr(theirs, "bias_hh_l0", None))
        assert 0 < bias.detach().abs().max() <= 1.3 * usual_bias.detach().abs().max()
    n_inputs = 49 * 3 + 4 + 7  # three numbers for each cell of the view, the goal's object and colour one-hot
    assert 0.95 / n_inputs**0.5 < network.encoder.weight.detach().abs().max() <= 1 / n_inputs**0.5
    assert 0.5 / n_inputs**0.5 < network.encoder.bias.detach().abs().max() <= 1 / n_inputs**0.5


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
