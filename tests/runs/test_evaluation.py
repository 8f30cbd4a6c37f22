"""Evaluations count the right levels, goals and episodes."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from turns_helpers import make

from hierroom.agents.evaluation import evaluate
from hierroom.agents.player import Pair, Play
from hierroom.agents.recorder import record
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.commands import evaluate as command
from hierroom.goals import NAMED_GRAPHS
from hierroom.learners.config import PPOConfig
from hierroom.meta import META_CONTROLLERS, make_meta
from hierroom.runs.assembly import freeze
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig


class Still:
    """Tries to open nothing."""

    def step(self, turns):
        return turns.step(np.full(len(turns), 4))


class Turning:
    """Only ever turns, and notes how many rooms the levels have that it is put into."""

    def __init__(self):
        self.sizes = []

    def step(self, turns):
        self.sizes.append(int(turns.world.state.levels["n_rooms"][0]))
        return turns.step([1])


def test_table_has_the_goals_of_every_played_level():
    graphs, player = [NAMED_GRAPHS["a"], NAMED_GRAPHS["g"]], Turning()
    tables = {}
    for seed in range(8):
        player.sizes.clear()
        turns = make(graphs, 1, max_steps=3, seed=seed, measure_shortest=True)
        table = evaluate(player, turns, 3).steps_to_goals
        largest = max(player.sizes)
        assert list(table) == [f"{kind} {r}" for kind in ("key", "door") for r in range(1, largest)] + ["exit"]
        tables[largest, int(turns.world.state.levels["n_rooms"][0])] = table
    assert (4, 2) in tables  # a small level stands there at the end, and large ones were played


@pytest.mark.parametrize(("asked", "num_envs", "played"), [(100, 10, 20), (100, 25, 25), (10, 10, 10), (1000, 10, 60)])
def test_evaluation_without_success_stops_early(asked, num_envs, played):
    """At 50% success the interval is widest: 0.19 for 100 episodes; 20 failures leave 0.16, and 10 leave 0.28."""

    def evaluated(episodes, **settings):
        turns = make([NAMED_GRAPHS["a"]], num_envs, max_steps=3, measure_shortest=True)
        return evaluate(Still(), turns, episodes, **settings)

    stopped = evaluated(asked, may_stop=True)
    assert stopped.episodes == played
    assert repr(stopped) == repr(evaluated(played))  # NaN does not equal NaN
    assert evaluated(asked).episodes == asked


CONFIG = TrainConfig(EnvConfig("b", size=11, max_steps=100), num_envs=16, steps=60_000, ppo=PPOConfig(minibatches=2))


@pytest.fixture
def evaluated(capsys):
    def evaluated(*options, agent="b"):
        assert command.main([str(agent), "--episodes", "100", "--json", *options]) == 0
        return json.loads(capsys.readouterr().out)["sampled"]

    return evaluated


@pytest.mark.slow
def test_earlier_checkpoint_has_lower_success(evaluated, tmp_path):
    folder, trainer = RunFolder.create(tmp_path / "run", CONFIG), Trainer(CONFIG)
    folder.save_checkpoint(trainer.state_dict())
    while not trainer.is_done:
        trainer.advance()
    folder.save_checkpoint(trainer.state_dict())
    early, late = (evaluated(*one, agent=folder.path)["success_rate"] for one in (("--checkpoint", "0"), ()))
    assert early < 0.5 < late
    with pytest.raises(InputError, match="has checkpoints after 0, "):
        evaluated("--checkpoint", "1", agent=folder.path)


def test_graph_option_replaces_the_runs_graphs(evaluated):
    """Zero-shot: the agent of graph b in a set that has one room more, without the excluded graphs."""
    assert "key 2" in evaluated()["steps_to_goals"]
    assert "key 2" not in evaluated("--graph", "a")["steps_to_goals"]
    several = evaluated("--graph", "a", "rooms:4", "--exclude", "g")
    assert "key 3" in several["steps_to_goals"]
    assert several["length"] != evaluated("--graph", "a", "rooms:4")["length"]
    with pytest.raises(InputError, match="cannot exclude g: it is not among the goal graphs of b"):
        evaluated("--exclude", "g")
    with pytest.raises(InputError, match="--exclude is given twice"):
        evaluated("--graph", "rooms:4", "--exclude", "g", "--exclude", "e")


def test_meta_option_gives_other_goals(evaluated):
    """The oracle never asks for the key of the room without the exit, key 2; the fixed path does half the time."""
    fixed, oracle = evaluated(), evaluated("--meta", "oracle")
    assert (
        oracle["steps_to_goals"]["key 2"]["fraction"] < fixed["steps_to_goals"]["key 2"]["fraction"] - 0.2
    )  # by mistake
    assert oracle["length"] < fixed["length"]
    hindered = evaluated("--meta", "random", "--goal-mask", "existing")
    assert hindered["success_rate"] < fixed["success_rate"]
    for wrong in ("learned", "nobody"):
        with pytest.raises(InputError, match=r"is made in training|a meta-controller is one of"):
            evaluated("--meta", wrong)
    with pytest.raises(InputError, match="goal_mask must be one of reachable, existing, seen, none, not 'all'"):
        evaluated("--goal-mask", "all")


class Whole:
    """A pair in disguise, so that `Play` cannot leave environments out."""

    def __init__(self, pair):
        self.step = pair.step


def sizes_in(turns, player, episodes):
    return [len(step.rewards) for step in Play(turns, player, episodes)]


@pytest.mark.parametrize("is_greedy", [False, True])
@pytest.mark.parametrize("meta", [*META_CONTROLLERS])
def test_skipping_finished_environments_changes_nothing(meta, is_greedy):
    trainer = Trainer(CONFIG)
    trainer.advance()

    def player(disguise):
        return disguise(freeze(ScriptedAgent(make_meta(meta)), trainer.controller, 24, seed=3, is_greedy=is_greedy))

    def observed(disguise):
        turns = partial(trainer.fresh_turns, 24, 3, graph=("rooms:3",))
        sizes = sizes_in(turns(), player(disguise), 60)
        episodes = [episode.to_dict() for episode in record(turns(), player(disguise), 60)]
        return sizes, (repr(evaluate(player(disguise), turns(), 60)), episodes)

    (whole_sizes, whole), (sizes, ours) = observed(Whole), observed(lambda pair: pair)
    assert ours == whole
    assert {*whole_sizes} == {24}
    assert len(sizes) == len(whole_sizes)
    assert sizes[0] == 24
    assert sizes[-1] <= 12


def test_custom_code_and_curricula_step_all_environments():
    class OwnMeta(META_CONTROLLERS["fixed-dfs"]):
        pass

    class OwnPair(Pair):
        pass

    def first(level):
        return next(iter(level.legal_goals), None)

    trainer = Trainer(CONFIG)
    trainer.advance()

    def sizes(meta, turns, kind=Pair):
        pair = kind(freeze(ScriptedAgent(make_meta(meta)), trainer.controller, 24, seed=3).agents)
        return {*sizes_in(turns, pair, 36)}

    def turns(**settings):
        return Turns(replace(trainer.config.env, **settings), 24, seed=3, memories=trainer.controller.features.memories)

    assert min(sizes("fixed-dfs", turns())) < 24
    assert sizes("fixed-dfs", turns(), OwnPair) == {24}
    assert sizes(OwnMeta(), turns()) == sizes(first, turns()) == {24}
    assert sizes("fixed-dfs", turns(graph=("a", "rooms:3"), curriculum_stages=3)) == {24}
    assert sizes("fixed-dfs", turns(reward=lambda step: step.reached)) == {24}  # it may have a memory
