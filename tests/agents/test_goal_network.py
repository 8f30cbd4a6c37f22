"""The learned meta-controller's network, and its features."""

import numpy as np
import pytest
import torch
from escape_room import WORLD

from hierroom.agents.features import Features
from hierroom.agents.goal_network import GoalNetwork
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.runs.assembly import make_agents
from hierroom.runs.config.presets import find_preset
from hierroom.turns.records import META


def test_permuting_colours_permutes_the_logits():
    cardinalities = Features(WORLD, find_preset("learned").agents.meta_features, META).cardinalities
    network = GoalNetwork(AgentSpace(cardinalities, 14), 8, N_COLOURS)
    with torch.no_grad():
        for head in (network.colour_head, network.exit_head):
            head.weight.normal_()
    rng = np.random.default_rng(0)
    features = torch.from_numpy(rng.integers(0, cardinalities, (6, 5, 26)).astype(np.uint8))
    colours = rng.permutation(N_COLOURS)
    goals = np.concatenate([colours, FIRST_DOOR_GOAL + colours, [EXIT_GOAL]])
    permuted = features[..., np.concatenate([goals, N_GOALS + goals])]
    resets = torch.from_numpy(rng.random((6, 5)) < 0.3)
    state = network.initial_state(5)
    logits, values = network.sequence(features, state, resets)
    logits_too, values_too = network.sequence(permuted, state, resets)
    torch.testing.assert_close(logits[..., [*goals, N_GOALS]], logits_too)
    torch.testing.assert_close(values, values_too)
    assert logits.std() > 0.1
    for t in range(6):  # and a sequence is its steps
        state = torch.where(resets[t, :, None], network.initial_state(5), state)
        step_logits, step_values, state = network.step(features[t], state)
        torch.testing.assert_close(step_logits, logits[t])
        torch.testing.assert_close(step_values, values[t])


@pytest.mark.parametrize(("task", "are_alike"), [(None, True), ("workshop:4", False)])
def test_network_treats_colours_alike_but_not_items(task, are_alike):
    meta, _ = make_agents(find_preset("learned").changed(task=task, num_envs=4, threads=1))
    network, features = meta.learner.network, torch.zeros(1, meta.learner.space.n_features, dtype=torch.uint8)
    with torch.no_grad():
        logits, _, _ = network.step(features, network.initial_state(1))
    assert torch.isclose(logits[0, 0], logits[0, 1], rtol=1e-4, atol=0).item() == are_alike
