"""A learner that is saved in the middle of its turns and loaded goes on exactly as if it had not been."""

import io
from copy import deepcopy

import pytest
import torch
from learner_envs import PlainTorchNetwork, RandomEnvs, make_learner
from same_state import equal


@pytest.mark.parametrize("network", [None, PlainTorchNetwork], ids=["compiled", "torch"])
@pytest.mark.parametrize("ticks", [3, 37])
def test_resumed_equals_uninterrupted_bit_for_bit(network, ticks):
    learner, envs = make_learner(network=network), RandomEnvs(6, seed=1)
    for _ in range(ticks):
        envs.tick(learner)
    begun, _, _ = envs.begin(learner)
    file = io.BytesIO()
    torch.save(learner.state_dict(), file)
    file.seek(0)
    resumed, envs_then = make_learner(network=network, seed=99), deepcopy(envs)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    envs.finish(learner, begun)
    envs_then.finish(resumed, begun)
    for _ in range(40):
        _, _, actions, statistics = envs.tick(learner)
        _, _, actions_after, statistics_after = envs_then.tick(resumed)
        assert (actions == actions_after).all()
        assert statistics == statistics_after
    assert equal(learner.state_dict(), resumed.state_dict())
