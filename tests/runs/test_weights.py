"""Agents in one file: shipped and custom ones, and damaged or forged files."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import make_vec
from gymnasium.utils.env_checker import check_env
from safetensors import safe_open
from safetensors.torch import save_file

import hierroom
from hierroom.agents.config import AgentsConfig
from hierroom.agents.evaluation import evaluate
from hierroom.meta import FixedDFS, choose_goals
from hierroom.runs.assembly import make_agents
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.weights import FOLDER, SHIPPED, SavedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig

ROOM = "hierroom/EscapeRoom-g-v0"
SHORT = {"size": 11, "max_steps": 40, "num_envs": 4, "steps": 300, "evaluations": 0, "log": "none", "film": False}


def played(agent: hierroom.TrainedAgent) -> list[list[int]]:
    return [episode.actions.tolist() for episode in hierroom.rollout(agent, episodes=3, seed=4)]


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> hierroom.TrainedAgent:
    return hierroom.train(graph="a", sequence_length=16, out=tmp_path_factory.mktemp("runs") / "run", **SHORT)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_agent_escapes(name):
    agent = hierroom.load(name)
    assert agent.config.env.graph == name[-1]
    assert agent.config == hierroom.find_preset("learned" if "learned" in name else "default").changed(
        graph=name[-1], threads=1, evaluation_episodes=100, device="cpu"
    )
    assert agent.steps >= agent.config.steps
    found = evaluate(agent.pair(50, seed=1), agent.turns(50, seed=1), 100)
    assert found.success_rate >= 0.95


@pytest.mark.parametrize("meta", [None, pytest.param("learned", marks=pytest.mark.slow)])
def test_saved_agent_plays_like_its_run(tmp_path, meta):
    settings = {**SHORT, "preset": "learned", "meta": meta, "meta_start_success": 0.0} if meta else SHORT
    agent = hierroom.train(graph="b", sequence_length=16, out=tmp_path / "run", **settings)
    agent.save(tmp_path / "mine.safetensors")
    loaded = hierroom.load(tmp_path / "mine.safetensors")
    assert played(loaded) == played(hierroom.load(tmp_path / "run"))
    assert (loaded.config, loaded.steps) == (agent.config, agent.steps)
    assert played(hierroom.load(tmp_path / "mine.safetensors", meta="oracle")) == played(
        hierroom.load(tmp_path / "run", meta="oracle")
    )


def test_meta_controller_alone_matches_its_pair():
    agent = hierroom.load("learned-g")
    turns, alone, pair = agent.turns(8, seed=1), agent.meta_controller(8), agent.pair(8)
    for _ in range(200):
        situation = turns.situation(turns.due("meta_0"))
        if len(situation):
            choose_goals(alone, situation)
        pair.choose(turns)
        if len(situation):
            logits = [one.decision.logits for one in (alone._policy, pair.agents["meta_0"])]
            np.testing.assert_array_equal(*logits)
        step = turns.step()
        for one in pair.agents.values():
            one.record(step, turns)
    played(hierroom.load("g", meta=agent.meta_controller()))


def goals_of(meta, num_envs, env_index=0, seed=3):
    """Return the goals of the first environment in an episode, observed after each step."""
    settings = {"max_steps": 60, "subgoal_horizon": 4, "goal_mask": "existing", "env_index": env_index}
    envs = make_vec(ROOM, num_envs, meta=meta, autoreset_mode="Disabled", **settings)
    rng, goals = np.random.default_rng(0), [envs.reset(seed=seed)[0]["goal"][0].tolist()]
    for _ in range(59):
        goals.append(envs.step(np.full(num_envs, rng.integers(5)))[0]["goal"][0].tolist())
    return goals


def test_meta_controller_goals_depend_only_on_seeds():
    agent = hierroom.load("learned-g")
    meta = agent.meta_controller(3)
    goals = goals_of(meta, 3)
    assert goals == goals_of(meta, 3) == goals_of(agent.meta_controller(), 1)
    assert len({tuple(goal) for goal in goals}) > 1
    others = [goals_of(agent.meta_controller(seed=seed), 1) for seed in range(1, 6)]
    assert any(other != goals for other in others)
    check_env(gymnasium.make(ROOM, meta=agent.meta_controller()).unwrapped, skip_render_check=True)


def test_meta_controller_plays_in_gymnasium_environments():
    agent = hierroom.load("learned-g")
    env = gymnasium.make(ROOM, meta=agent.meta_controller())
    goals = {tuple(env.reset(seed=seed)[0]["goal"]) for seed in range(9)}
    assert len(goals) > 1
    several = make_vec(ROOM, 3, meta=agent.meta_controller(3, seed=1))
    several.reset(seed=3)
    for _ in range(5):
        several.step(np.zeros(3, int))
    few = make_vec(ROOM, 3, meta=agent.meta_controller(2))
    with pytest.raises(InputError, match=r"made for 2 environments, not for environment 2; use meta_contr"):
        few.reset(seed=3)


def test_meta_controller_with_remembered_features_raises_input_error(trained):
    assert isinstance(trained.meta_controller(), FixedDFS)
    learned = TrainConfig(EnvConfig("a"), agents=AgentsConfig(meta="learned", meta_features=("doorway-places",)))
    meta, controller = make_agents(learned)
    with pytest.raises(InputError, match=r"only levels of its own run remember \(doorways\)"):
        hierroom.TrainedAgent(learned, meta, controller, 0).meta_controller()


def test_load_prefers_a_folder_to_a_shipped_agent(tmp_path, monkeypatch, trained):
    monkeypatch.chdir(tmp_path)
    Path("c").symlink_to(trained.path)
    assert hierroom.load("c").path == Path("c")
    assert hierroom.load("d").path == FOLDER / "d.safetensors"


def test_damaged_weights_file_raises_input_error(tmp_path, trained):
    path = tmp_path / "mine.safetensors"
    trained.save(path)
    content, rng = path.read_bytes(), np.random.default_rng(0)
    for place in rng.integers(8, len(content), 60).tolist():
        path.write_bytes(content[:place] + bytes([content[place] ^ (1 << int(rng.integers(8)))]) + content[place + 1 :])
        with pytest.raises(InputError):
            hierroom.load(path)
    for end in (0, 7, 100, len(content) - 1):
        path.write_bytes(content[:end])
        with pytest.raises(InputError, match=r"mine.safetensors is no file of weights, or damaged|is damaged"):
            hierroom.load(path)


def change_metadata(path: Path, **metadata: str) -> None:
    with safe_open(path, "pt") as file:
        header, tensors = file.metadata(), {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    save_file(tensors, path, {**header, **metadata})


def test_changed_metadata_raises_input_error(tmp_path, trained):
    path = tmp_path / "mine.safetensors"
    trained.save(path)
    change_metadata(path, steps="7")
    with pytest.raises(InputError, match="is damaged"):
        hierroom.load(path)
    change_metadata(path, format="something else")
    with pytest.raises(InputError, match="holds no agent of this hierroom: its format is 'something else'"):
        hierroom.load(path)


def test_weights_file_runs_no_code(tmp_path, trained):
    saved = SavedAgent.read(_saved(tmp_path, trained))
    lying = SavedAgent(saved.config.changed(meta="http.server:test"), saved.steps, saved.agents)
    lying.write(tmp_path / "lying.safetensors")
    with pytest.raises(InputError, match=r"lying.safetensors names code .*'http.server:test'"):
        hierroom.load(tmp_path / "lying.safetensors")
    assert hierroom.load(tmp_path / "lying.safetensors", meta="oracle").steps == saved.steps


def test_weights_of_another_network_are_refused(tmp_path, trained):
    saved = SavedAgent.read(_saved(tmp_path, trained))
    other = SavedAgent(saved.config.changed(hidden_size=32), saved.steps, saved.agents)
    other.write(tmp_path / "other.safetensors")
    with pytest.raises(InputError, match="these weights belong to another agent, with hidden_size 64, not 32"):
        hierroom.load(tmp_path / "other.safetensors")
    SavedAgent(saved.config, saved.steps, {}).write(tmp_path / "empty.safetensors")
    with pytest.raises(InputError, match=r"empty\.safetensors does not fit its config"):
        hierroom.load(tmp_path / "empty.safetensors")


def test_crafted_weights_file_raises_input_error(tmp_path, trained):
    path = tmp_path / "mine.safetensors"
    save_file({"controller_0.encoder.weight": torch.tensor(1.0)}, path, {"format": "hierroom agent 1"})
    with pytest.raises(InputError, match="is damaged"):
        hierroom.load(path)
    saved = SavedAgent.read(_saved(tmp_path, trained))
    SavedAgent(saved.config, -5, saved.agents).write(path)
    with pytest.raises(InputError, match=r"Expected `int` >= 0 - at `\$.steps`"):
        hierroom.load(path)


@pytest.mark.parametrize("is_file", [False, True])
def test_warm_start_takes_shipped_agents_and_files(tmp_path, is_file):
    source = tmp_path / "mine.safetensors" if is_file else "a"
    if is_file:
        hierroom.load("a").save(source)
    warm = Trainer(hierroom.find_preset("default").changed(graph="f", warm_start=str(source)))
    ours, theirs = warm.controller.weights, hierroom.load("a").controller.weights
    for name, tensor in theirs["learner"]["backend"]["network"].items():
        assert torch.equal(ours["learner"]["backend"]["network"][name], tensor)
    with pytest.raises(InputError, match=r"cannot warm-start this run: .*hidden_size 64, not 32"):
        Trainer(warm.config.changed(hidden_size=32))


def test_invalid_save_or_load_raises_input_error(tmp_path, trained):
    with pytest.raises(InputError, match=r"saved to a \.safetensors file, not .*mine\.pt"):
        trained.save(tmp_path / "mine.pt")
    with pytest.raises(InputError, match="cannot write"):
        trained.save(tmp_path / "nowhere" / "mine.safetensors")
    for name in ("a", "learned-g"):
        with pytest.raises(InputError, match="is another than the agent was trained with"):
            hierroom.load(name, meta="oracle").save(tmp_path / "mine.safetensors")
    with pytest.raises(InputError, match="holds one agent, and no checkpoints"):
        hierroom.load("a", checkpoint=3)
    with pytest.raises(InputError, match=r"^a meta-controller is one of"):
        hierroom.load("a", meta="nobody")
    with pytest.raises(InputError, match="there is no run z, and the agents that ship with hierroom are a, b"):
        hierroom.load("z")
    with pytest.raises(InputError, match=r"there is no file .*none\.safetensors"):
        hierroom.load(tmp_path / "none.safetensors")


def _saved(folder: Path, agent: hierroom.TrainedAgent) -> Path:
    agent.save(folder / "mine.safetensors")
    return folder / "mine.safetensors"
