"""Networks that learn the initial recurrent state of an episode: it is always current, and never written to."""

import numpy as np
import torch
from learner_envs import PlainTorchNetwork, RandomEnvs, make_learner
from torch import nn


class LearnsItsStart(PlainTorchNetwork):
    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        self.start = nn.Parameter(torch.zeros(1, super().initial_state(1).shape[1]))

    def initial_state(self, n):
        return self.start.expand(n, -1)

    def sequence(self, features, state, resets):
        outputs = []
        for t in range(len(features)):
            state = torch.where(resets[t].unsqueeze(-1), self.initial_state(len(state)), state)
            *output, state = self.step(features[t], state)
            outputs.append(output)
        logits, values = zip(*outputs, strict=True)
        return torch.stack(logits), torch.stack(values)


def test_episodes_begin_in_the_networks_current_initial_state():
    learner, envs = make_learner(network=LearnsItsStart), RandomEnvs(6, seed=1)
    for _ in range(200):
        envs.tick(learner)
    now = learner.network.start.detach().numpy()
    assert np.abs(now).max() > 1e-4, "it has learned"
    seen = []
    step = learner._backend.step
    learner._backend.step = lambda features, states: (seen.append(states.copy()), step(features, states))[1]
    learner._starts_episode[:] = True
    begun, _, _ = envs.begin(learner)
    np.testing.assert_array_equal(seen[0], np.repeat(now, len(begun), axis=0))


def test_playing_does_not_change_the_learned_initial_state():
    learner, envs = make_learner(network=LearnsItsStart), RandomEnvs(6, seed=1)
    for _ in range(50):
        envs.tick(learner)
    before = learner.network.start.detach().clone()
    policy = learner.policy(3, seed=0)
    features = np.zeros((3, learner.space.n_features), np.uint8)
    for _ in range(3):
        policy.act(np.arange(3), features, np.ones((3, learner.space.n_actions), bool))
    assert torch.equal(learner.network.start, before)
    assert len(np.unique(policy._states, axis=0)) == 1, "each environment has a row of its own, and these are alike"
