"""Every example runs as it stands."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from run_contents import check_picture, check_run, weights
from turns_helpers import achieve, goal_ids, make

from hierroom.agents.player import Pair, Play
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.meta import choose_goals, make_meta, take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import EXIT, KEY, LOCKED_DOOR
from hierroom.worlds.escape_room.oracle import shortest_actions

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ["--size", "11", "--num-envs", "16", "--evaluations", "2", "--evaluation-episodes", "20"]
SAYS = {
    "aec.py": "turns: {'meta_0': ",
    "parallel.py": "returns: {'meta_0': ",
    "gymnasium_vector.py": "steps a second",
    "trained_agent.py": "of 100 episodes escaped, in ",
    "warm_start.py": "began with the weights of the first",
    "minigrid_chain.py": "-> key held, door open: -",
    "supersuit_sb3.py": "2048 turns of both agents in 4 environments",
}


def run(*arguments):
    done = subprocess.run([sys.executable, *arguments], cwd=EXAMPLES, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_run():
    own = {"own_meta_controller.py", "own_learning_meta.py", "own_watching_meta.py", "own_network.py", "own_reward.py"}
    own |= {"policy_sketches.py"}
    elsewhere = {"single_file.py"}  # tests/docs/test_single_file.py
    assert {path.name for path in EXAMPLES.glob("*.py")} == {*SAYS, *own, *elsewhere}


@pytest.mark.parametrize("name", SAYS)
def test_example(name):
    assert SAYS[name] in run(name)


@pytest.mark.parametrize("name", ["nearest", "NearestKeyFirst"])
def test_the_meta_controller_of_ones_own_trains(name, tmp_path, monkeypatch):
    """From a file outside the package, named on the command line."""
    settings = [*SHORT, "--graph", "a", "--steps", "4000"]
    run("-m", "hierroom.train", "--meta", f"own_meta_controller:{name}", *settings, "--out", str(tmp_path / "run"))
    monkeypatch.syspath_prepend(EXAMPLES)
    assert check_run(tmp_path / "run")["steps"] == 4096  # 8 updates
    assert check_picture(tmp_path / "run")
    assert RunFolder.open(tmp_path / "run").config().agents.meta == f"own_meta_controller:{name}"


def test_the_learning_meta_controller_of_ones_own_learns_what_can_be_reached(tmp_path):
    settings = [*SHORT, "--graph", "c", "--steps", "30000", "--max-steps", "200"]
    goals = ["--meta", "own_learning_meta:ReachedMostOften", "--goal-mask", "existing", "--subgoal-horizon", "30"]
    run("-m", "hierroom.train", *goals, *settings, "--out", str(tmp_path / "run"))
    counts = RunFolder.open(tmp_path / "run").load_checkpoint()["agents"][META]
    rates = dict(enumerate((counts["reached"] / counts["tried"]).tolist()))
    door_without_key, door_with_key = (2 * kind + 1 for kind in (1, 2))  # both seen
    assert counts["tried"].sum() > 1000
    assert rates[door_without_key] < 0.2 < rates[door_with_key]
    assert "success" in run("-m", "hierroom", "evaluate", str(tmp_path / "run"), "--episodes", "20", "--trust-run")


@pytest.mark.parametrize("meta", ["own_learning_meta:ReachedMostOften", "own_watching_meta:OthersFirst"])
def test_a_meta_controller_of_ones_own_with_a_memory_is_resumed_as_if_nothing_had_happened(meta, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    env = EnvConfig("c", size=11, goal_mask="existing", subgoal_horizon=20)
    config = TrainConfig(env, num_envs=8, steps=4096).changed(meta=meta)
    through, before = Trainer(config), Trainer(config)
    through.advance()
    before.advance()
    after = Trainer(config)
    after.load_state_dict(before.state_dict())
    for trainer in (through, after):
        for _ in range(3):
            trainer.advance()
    ours, theirs = (trainer.agents[META].state_dict().values() for trainer in (through, after))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)
        assert np.any(np.asarray(one))


def test_the_watching_meta_controller_of_ones_own_is_better_in_play_than_one_that_does_not_watch(monkeypatch):
    """With a controller that goes the shortest way, and to what cannot be reached nowhere until its horizon ends."""
    monkeypatch.syspath_prepend(EXAMPLES)
    from own_watching_meta import OthersFirst

    class Blind(OthersFirst):
        def observe(self, step, turns):
            pass

    class Controller:
        """Turns on the spot, but where its goal can be reached goes the shortest way there."""

        def act(self, observation):
            state, goals = turns.world.get_state(), observation.goals
            reachable = turns.situation(observation.envs).reachable
            return np.array(
                [
                    shortest_actions(state[n], int(goal))[0] if goal >= 0 and reachable[n, goal] else 1
                    for n, goal in enumerate(goals)
                ]
            )

        def record(self, step, turns):
            pass

    lengths = {}
    for kind in (OthersFirst, Blind):
        turns = Turns(EnvConfig("f", goal_mask="existing", subgoal_horizon=50), 20, seed=0)
        pair = Pair({META: ScriptedAgent(kind(20)), CONTROLLER: Controller()})
        ended = [step.lengths[step.episode_ended] for step in Play(turns, pair, 20)]
        lengths[kind] = np.concatenate(ended).mean()
    assert lengths[OthersFirst] < 0.8 * lengths[Blind]


@pytest.mark.parametrize("reward", ["Closer", "hurry"])
def test_the_reward_of_ones_own_trains_and_is_known_to_evaluate_and_resume(reward, tmp_path):
    settings = [*SHORT, "--graph", "a", "--steps", "4000", "--max-steps", "100"]
    out = str(tmp_path / "run")
    run("-m", "hierroom.train", "--reward", f"own_reward:{reward}", *settings, "--out", out)
    assert RunFolder.open(out).config().env.reward == f"own_reward:{reward}"
    assert "success" in run("-m", "hierroom", "evaluate", out, "--episodes", "20", "--trust-run")
    run("-m", "hierroom.train", "--resume", out, "--steps", "6000", "--reward", f"own_reward:{reward}")


def test_the_reward_of_ones_own_is_nearness_by_hand(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    turns = Turns(EnvConfig("a", size=11, reward="own_reward:Closer"), 1, seed=0)
    take_turn(make_meta("fixed-dfs"), turns)
    key = int(turns.goals[0])
    for action in shortest_actions(turns.world.get_state(), key):
        before = turns.world.get_state().distances(turns.goals)[0]
        step = turns.step([action])
        after = turns.world.get_state().distances(np.array([key]))[0]
        shaping = 0.02 * before if step.reached[0] else 0.02 * (before - 0.95 * after)
        assert step.rewards[0] == pytest.approx(step.reached[0] + shaping)
    assert step.reached[0]


def test_the_network_of_ones_own_trains(tmp_path, monkeypatch):
    settings = [*SHORT, "--graph", "a", "--steps", "4000", "--max-steps", "100"]
    run("-m", "hierroom.train", "--network", "own_network:GatedMemory", *settings, "--out", str(tmp_path / "run"))
    monkeypatch.syspath_prepend(EXAMPLES)
    assert check_run(tmp_path / "run")["steps"] == 4096
    assert check_picture(tmp_path / "run")
    learned = weights(RunFolder.open(tmp_path / "run").load_checkpoint())
    parts = {f"core.{kind}_{where}" for kind in ("weight", "bias") for where in ("ih", "hh")}
    assert set(learned) == {"encoder.weight", "encoder.bias", "heads.weight", "heads.bias", *parts}


def distance(state, m, tile):
    """Rows plus columns from the agent of an environment to the only cell with a tile."""
    ((row, col),) = np.argwhere(state.grids[m] == tile)
    return abs(row - state.levels[m].row) + abs(col - state.levels[m].col)


def test_the_class_of_ones_own_chooses_the_nearest_key(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    from own_meta_controller import NearestKeyFirst

    turns = make("e", 50, size=19)
    take_turn(NearestKeyFirst(), turns)
    state, n_unequal = turns.world.state, 0
    for m in range(50):
        ways = {colour: distance(state, m, KEY + colour) for colour in state.levels[m].colours[:3].tolist()}
        assert ways[int(turns.goals[m])] == min(ways.values())
        n_unequal += len(set(ways.values())) > 1
    assert n_unequal > 25

    alone = make("a")
    for name in ("k1", "d1", "x"):
        take_turn(NearestKeyFirst(), alone)
        assert {int(alone.goals[0])} == goal_ids(alone, name)
        if name != "x":
            achieve(alone, name)


def test_the_function_of_ones_own_chooses_the_nearest_goal(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    turns = make("e", 50, size=19, goal_mask="existing")
    take_turn(make_meta("own_meta_controller:nearest"), turns)
    state, kinds = turns.world.state, set()
    for m in range(50):
        colours = state.levels[m].colours[:3].tolist()
        tiles = {colour: KEY + colour for colour in colours} | {6 + colour: LOCKED_DOOR + colour for colour in colours}
        ways = {goal: distance(state, m, tile) for goal, tile in (tiles | {12: EXIT}).items()}
        assert ways[int(turns.goals[m])] == min(ways.values())
        kinds.add(int(turns.goals[m]) // 6)
    assert {0, 1} <= kinds  # keys and doors

    alone = make("a")
    for name in ("k1", "d1", "x"):
        take_turn(make_meta("own_meta_controller:nearest"), alone)
        assert {int(alone.goals[0])} == goal_ids(alone, name)
        if name != "x":
            achieve(alone, name)


@pytest.mark.parametrize("name", ["nearest", "NearestKeyFirst"])
def test_how_long_a_choice_takes(name, monkeypatch):
    """Shown by ``pytest -s``; a plain function is called once for each environment, and may take its time."""
    monkeypatch.syspath_prepend(EXAMPLES)
    meta, situation = make_meta(f"own_meta_controller:{name}"), make("c", 256, size=19).situation(np.arange(256))
    seconds = []
    for _ in range(5):
        started = time.perf_counter()
        choose_goals(meta, situation)
        seconds.append(time.perf_counter() - started)
    print(f"\n{name}: {1e6 * min(seconds) / 256:.1f} microseconds a choice, 256 environments at once")
    assert min(seconds) / 256 < 1e-3
