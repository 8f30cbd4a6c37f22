"""Algorithm 1 in one file: its length, what it imports, its parts next to the package's, and what it learns."""

import ast
import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
import torch
from children import run_python

from hierroom.learners.gae import generalized_advantages
from hierroom.turns.records import CONTROLLER, META

EXAMPLES = Path(__file__).parents[2] / "examples"
FILE = EXAMPLES / "single_file.py"


@pytest.fixture
def single_file(monkeypatch, one_thread):
    monkeypatch.syspath_prepend(EXAMPLES)
    import single_file

    with torch.random.fork_rng(devices=[]):
        yield single_file


def settings(**others):
    return Namespace(**({"meta": "learned", "graph": "c", "steps": 600_000, "seed": 0} | others))


def test_single_file_has_at_most_300_lines():
    assert len(FILE.read_text().splitlines()) <= 300


def test_single_file_imports_no_learner():
    imports = [node for node in ast.walk(ast.parse(FILE.read_text())) if isinstance(node, ast.ImportFrom | ast.Import)]
    names = {getattr(node, "module", None) or node.names[0].name for node in imports}
    others = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
    assert others == {"hierroom", "numpy", "torch"}
    code = "import sys, single_file; print([n for n in sys.modules if n.startswith('hierroom.')])"
    loaded = ast.literal_eval(run_python("-c", code, cwd=EXAMPLES).stdout)
    assert "hierroom.turns.turns" in loaded
    assert not [name for name in loaded if name.startswith(("hierroom.learners", "hierroom.runs"))]


def networks(single_file):
    """Return each network, its features and its number of logits; its policy is not nearly uniform, unlike at first."""
    controller = single_file.ActorCritic(single_file.CONTROLLER_FEATURES.cardinalities, 5)
    meta = single_file.MetaActorCritic((4,) * 4, 2, 2 * single_file.H)
    for network in (controller, meta):
        torch.nn.init.orthogonal_(network.policy.weight)
    return (controller, single_file.CONTROLLER_FEATURES, 5), (meta, single_file.META_FEATURES, 14)


def played(single_file, n_steps):
    turns = single_file.make_turns(settings(), 16, "training")
    turns.world.stagger_clocks()
    agents = {}
    for name, (network, features, n_actions) in zip((CONTROLLER, META), networks(single_file), strict=True):
        ppo = single_file.META_PPO if name == META else single_file.CONTROLLER_PPO
        ppo = single_file.PPO(ppo.gamma, ppo.sequence_length, 10**9, ppo.min_advantage_std)
        agents[name] = single_file.Learner(network, features, 16, n_actions, ppo)
    for _ in range(n_steps):
        single_file.play(turns, {META: agents[META], CONTROLLER: agents[CONTROLLER]})
    return agents


@pytest.mark.parametrize("name", [META, CONTROLLER])
def test_replayed_sequences_keep_their_action_probabilities(single_file, name):
    """Sequences contain ends of episodes. The first gradient step of an update is on the policy that acted."""
    agent = played(single_file, 500)[name]
    assert len(agent.sequences) >= 16
    n_ends = n_cut = 0
    for turns, first_state in agent.sequences:
        rows = {key: torch.from_numpy(turns[key].copy()).unsqueeze(1) for key in turns.dtype.names}
        ended = rows["episode_ended"][:-2]
        begins = torch.cat([torch.zeros(1, 1, dtype=torch.bool), ended])
        with torch.no_grad():
            logits, values, _ = agent.network(rows["features"][:-1], torch.from_numpy(first_state).unsqueeze(0), begins)
        policy = single_file.masked(logits, rows["mask"][:-1])
        torch.testing.assert_close(policy.log_prob(rows["action"][:-1]), rows["log_prob"][:-1], atol=1e-5, rtol=1e-4)
        torch.testing.assert_close(values, rows["value"][:-1], atol=1e-5, rtol=1e-4)
        assert rows["mask"][:-1].gather(-1, rows["action"][:-1].unsqueeze(-1)).all()
        n_ends, n_cut = n_ends + int(ended.sum()), n_cut + int((turns["truncated"] & (turns["final_value"] != 0)).sum())
    assert n_ends
    assert n_cut


@pytest.mark.parametrize("name", [META, CONTROLLER])
def test_advantages_equal_the_packages(single_file, name):
    agent = played(single_file, 500)[name]
    stored = np.stack([turns for turns, _ in agent.sequences], axis=1)
    turns, now = {key: torch.from_numpy(stored[key].copy()) for key in stored.dtype.names}, stored[:-1]
    expected = generalized_advantages(
        now["reward"],
        now["value"],
        np.where(now["truncated"], now["final_value"], stored["value"][1:]),
        now["elapsed"].astype(np.int64),
        now["terminated"],
        now["truncated"],
        gamma=agent.ppo.gamma,
        gae_lambda=agent.ppo.gae_lambda,
    )
    np.testing.assert_allclose(agent.advantages(turns).numpy(), expected, rtol=1e-4, atol=1e-6)
    assert (now["elapsed"] > 1).any() == (name == META)
    assert now["truncated"].any()


@pytest.mark.slow
def test_both_agents_learn_to_escape(single_file):
    few, many = settings(graph="a", steps=64), settings(graph="a", steps=200_000)
    untrained, trained = single_file.train(few), single_file.train(many)
    success, length = single_file.evaluate(many, trained)
    assert success >= 0.95
    for name in (META, CONTROLLER):
        _, without = single_file.evaluate(many, {**trained, name: untrained[name]})
        assert without > 1.2 * length, name
