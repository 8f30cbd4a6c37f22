"""Random network distillation: numbers by hand, and lower rewards for frequent observations."""

import io

import numpy as np
import pytest
import torch

from hierroom.learners.config import PPOConfig
from hierroom.learners.distillation import GROWTH, RandomNetworkDistillation, whitening
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER
from hierroom.worlds.env_config import EnvConfig

SIZES = (4, 3)
SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=2048).changed(method="ppo-rnd")


def make(num_envs=6, seed=0):
    return RandomNetworkDistillation(SIZES, num_envs, gamma=0.9, seed=seed, hidden_size=16)


def draw(rng, n=6):
    return rng.integers(0, SIZES, (n, 2)).astype(np.uint8)


def test_whitening_by_hand():
    # Shares 1/4 and 3/4; then 1 in 101, with its one clipped; then a column that never changes.
    scale, shift = whitening(np.array([1.0, 3, 1, 100, 7]), np.array([2, 2, 1]))
    one, zero = scale + shift, shift
    np.testing.assert_allclose(zero, [-(3**-0.5), -(3**0.5), -0.1, -5, 0])
    np.testing.assert_allclose(one, [3**0.5, 3**-0.5, 5, 0.1, 0])


def test_errors_match_whitened_one_hot_features():
    curiosity, features = make(), draw(np.random.default_rng(0))
    curiosity._counts[:] = [5, 1, 2, 8, 3, 3, 9]
    scale, shift = whitening(curiosity._counts, np.array(SIZES))
    one_hot = np.concatenate([np.eye(n)[features[:, k]] for k, n in enumerate(SIZES)], axis=1)
    outputs = []
    for network in (curiosity.predictor, curiosity.target):
        hidden = torch.from_numpy(one_hot * scale + shift).float() @ network.weight + network.bias
        for layer in network.layers:
            hidden = layer(torch.relu(hidden))
        outputs.append(hidden)
    torch.testing.assert_close(curiosity._errors(features), (outputs[0] - outputs[1]).square().mean(-1))


def settled(curiosity, rng, n=6):
    """Let it learn once and its returns grow: it rewards from here on, and nothing before."""
    for _ in range(3):
        assert not curiosity.rewards(draw(rng, n)).any()
    curiosity.learn()
    for _ in range(20):  # two horizons at a discount of 0.9
        assert not curiosity.rewards(draw(rng, n)).any()
    return curiosity


def test_rewards_are_errors_over_the_deviation_of_returns():
    curiosity, rng = make(), np.random.default_rng(1)
    curiosity.rewards(draw(rng))
    curiosity.learn()
    returns, counted = np.zeros(6), []
    for t in range(40):
        features = draw(rng)
        errors = curiosity._errors(features).detach().numpy().astype(np.float64)
        returns = 0.9 * returns + errors
        rewards = curiosity.rewards(features)
        if t >= 20:
            counted.extend(returns)
            np.testing.assert_allclose(rewards, errors / np.std(counted), rtol=1e-6)


def test_the_first_return_of_a_single_environment_earns_nothing():
    """One return has no deviation: divided by a tiny number, the first reward was above ten million once."""
    curiosity, rng = make(num_envs=1), np.random.default_rng(4)
    settled(curiosity, rng, 1)
    rewards = [curiosity.rewards(draw(rng, 1)).item() for _ in range(20)]
    assert rewards[0] == 0
    assert 0 < max(rewards) < 100


def test_frequent_observations_earn_less_than_rare_ones():
    curiosity, rng = make(num_envs=32), np.random.default_rng(2)
    rare, features = np.tile(np.array([[3, 2]], np.uint8), (32, 1)), np.empty((32, 2), np.uint8)
    for _ in range(60):
        for _ in range(8):
            features[:] = rng.integers(0, (3, 2), (32, 2))
            curiosity.rewards(features)
        target = {name: tensor.clone() for name, tensor in curiosity.target.state_dict().items()}
        curiosity.learn()
        assert all(torch.equal(tensor, target[name]) for name, tensor in curiosity.target.state_dict().items())
    assert curiosity.rewards(rare).mean() > 5 * curiosity.rewards(features).mean()


def test_resumed_distillation_equals_an_uninterrupted_one():
    through, rng = make(), np.random.default_rng(3)
    for t in range(25):
        through.rewards(draw(rng))
        if t % 10 == 9:
            through.learn()
    file = io.BytesIO()
    torch.save(through.state_dict(), file)
    file.seek(0)
    resumed = make(seed=9)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    for _ in range(3):
        for _ in range(4):
            features = draw(rng)
            np.testing.assert_array_equal(through.rewards(features), resumed.rewards(features))
        assert through.learn() == resumed.learn()


def test_curiosity_rewards_new_observations_of_the_level():
    trainer = Trainer(SMALL.changed(ppo=PPOConfig(sequence_length=200)))
    turns, agent, observed = trainer.turns, trainer.agents[CONTROLLER], []
    curiosity, finish = agent.curiosity, agent.learner.finish
    assert curiosity is not None
    assert curiosity.features.names == ["view", "direction", "keys"]
    agent.learner.finish = lambda envs, rewards, *rest: observed.append(rewards) or finish(envs, rewards, *rest)

    def step(action):
        observation = turns.observe(CONTROLLER, turns.due(CONTROLLER))
        agent.act(observation)
        turns.act(CONTROLLER, observation, np.full(8, action))
        taken = turns.step()
        agent.record(taken, turns)
        return taken

    for _ in range(1 + round(GROWTH / (1 - SMALL.ppo.gamma))):  # first all is counted only, then the returns grow
        step(0)
        assert not observed[-1].any()
        if not curiosity.state_dict()["has_learned"]:
            curiosity.learn()
    last = step(0)
    assert (observed[-1] > 0).all()
    while not last.episode_ended.any():
        last = step(1)
    ended, found = np.flatnonzero(last.episode_ended), curiosity.state_dict()["pending"][-1].numpy()
    final = curiosity.features.encode(turns.final_observation(CONTROLLER, last, ended))
    now = turns.observe(CONTROLLER, turns.due(CONTROLLER))
    assert not np.array_equal(final, curiosity.features.encode(now)[ended])
    np.testing.assert_array_equal(found[ended], final)


def test_distillation_learns_from_a_single_observation():
    distillation = RandomNetworkDistillation((3, 4), 1, gamma=0.9, seed=0)
    distillation.rewards(np.array([[1, 2]], np.uint8))
    assert np.isfinite(distillation.learn()["curiosity_error"])
    assert all(tensor.isfinite().all() for tensor in distillation.predictor.state_dict().values())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"curiosity_weight": -1.0}, "curiosity_weight must be a number of at least 0, not -1.0"),
        ({"features": ("previous-action",)}, "curiosity needs features of the level; previous-action has none"),
    ],
)
def test_invalid_curiosity_settings_raise_input_error(change, said):
    with pytest.raises(InputError, match=said):
        Trainer(SMALL.changed(**change))
