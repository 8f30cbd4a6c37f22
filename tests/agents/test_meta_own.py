"""Meta-controllers of one's own: how they are found, what they are given, and what is said of wrong ones."""

import gc
import re
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from turns_helpers import make

from hierroom import InputError
from hierroom.agents.scripted_agent import ScriptedAgent, unsaved_memory
from hierroom.gym_env import EscapeRoom
from hierroom.meta import META_CONTROLLERS, MetaController, make_meta, take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.session import begin, run_session
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import META
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

MINE = """
    import numpy as np

    class Mine:
        def choose(self, observations, legal, situation):
            return np.where(legal.any(axis=1), legal.argmax(axis=1), -1)

    class NoChoice:
        pass

    class Forgetful(Mine):
        def learn(self, step):
            pass

        def state_dict(self):
            return {}

    class Choosy:
        def __init__(self, taste):
            self.taste = taste

    class Odd:
        def __init__(self):
            class Stop(BaseException):
                pass

            raise Stop("no more")

    class Broken:
        def __init__(self):
            raise RuntimeError("out of\\ncheese")

    class Telling(Mine):
        statistics = {"gain": "much"}

    class Empty(Mine):
        @classmethod
        def for_training(cls, num_envs):
            return None

        def for_play(self, num_envs, *, seed):
            return None

    made = Mine()

    def nearest(level):
        return min(level.legal_goals, key=lambda goal: goal.distance)

    async def later(level):
        return None
"""


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """The name of a module in a folder outside the package; another one for each test, as Python remembers them."""
    name = re.sub(r"\W", "_", f"outside_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(textwrap.dedent(MINE))
    (tmp_path / f"{name}_broken.py").write_text("import nowhere_to_be_found\n")
    (tmp_path / f"{name}_typo.py").write_text("def choose(:\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [*sys.path])  # finding a module may add to it
    return name


def test_a_class_in_the_current_folder(outside):
    meta = make_meta(f"{outside}:Mine")
    assert isinstance(meta, MetaController)
    turns = make("a", 4)
    take_turn(meta, turns)
    assert turns.goals.tolist() == turns.world.state.levels["colours"][:, 0].tolist()


def test_an_entry_point_of_an_installed_package(outside, tmp_path, monkeypatch):
    installed = tmp_path / "lucky-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: lucky\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(f"[hierroom.meta_controllers]\nlucky = {outside}:Mine\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert type(make_meta("lucky")).__name__ == "Mine"


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("best", "a meta-controller is one of fixed-dfs, random, oracle, none, an entry point "),
        ("{outside}_x:Mine", "there is no module '{outside}_x' for the meta-controller '{outside}_x:Mine'"),
        ("{outside}_broken:Mine", "there is no module 'nowhere_to_be_found' for the meta-controller"),
        ("{outside}_typo:Mine", "the meta-controller '{outside}_typo:Mine' cannot be loaded: SyntaxError: "),
        ("{outside}:Yours", "the meta-controller '{outside}:Yours' cannot be loaded: AttributeError: module"),
        ("{outside}:NoChoice", "a meta-controller has a method choose(observations, legal, situation); '{outside}:No"),
        ("{outside}:Forgetful", "a meta-controller that learns has the methods state_dict and load_state_dict too"),
        ("{outside}:Choosy", "the meta-controller '{outside}:Choosy' cannot be made: TypeError: "),
        ("{outside}:Broken", "the meta-controller '{outside}:Broken' cannot be made: RuntimeError: out of cheese"),
        ("{outside}:Odd", "the meta-controller '{outside}:Odd' cannot be made: Stop: no more (line "),
        (
            "{outside}:Telling",
            "statistics of a meta-controller are numbers by name; 'gain' of '{outside}:Telling' is '",
        ),
        ("{outside}:made", "'{outside}:made' is an object with a method choose; name its class, to be made by"),
        (7, "a meta-controller has a method choose(observations, legal, situation); 7 has none"),
        (META_CONTROLLERS["random"], "a meta-controller is an object, not a class: make one of RandomGoals"),
    ],
)
def test_an_invalid_spec_raises_input_error(outside, spec, said):
    if isinstance(spec, str):
        spec, said = spec.format(outside=outside), said.format(outside=outside)
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        make_meta(spec)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("at", ["import", "choose"])
def test_a_working_folder_that_own_code_leaves_is_gone_back_to(outside, at, tmp_path):
    name = f"{outside}_{at}"
    leaves = f"import os\nos.chdir({str(tmp_path.parent)!r})"
    code = {"import": leaves, "choose": ""}[at] + "\ndef choose(level):\n" + textwrap.indent(leaves, "    ")
    (tmp_path / f"{name}.py").write_text(code)
    with pytest.warns(UserWarning, match=f"changes the working folder, which is {tmp_path} again$"):
        take_turn(make_meta(f"{name}:choose"), make("a", 2))
    assert Path.cwd() == tmp_path


def test_methods_that_make_one_must_return_one(outside, monkeypatch):
    with pytest.raises(InputError, match=f"^for_training of the meta-controller '{outside}:Empty' must return one"):
        make_meta(f"{outside}:Empty", 4)
    agent = ScriptedAgent(type(make_meta(f"{outside}:Mine"))())
    monkeypatch.setattr(agent.meta, "for_play", lambda num_envs, seed: None, raising=False)
    with pytest.raises(InputError, match=r"what for_play of Mine returned has none$"):
        agent.frozen(3, seed=0)


def test_a_coroutine_function_raises_input_error_without_a_warning(outside, recwarn):
    with pytest.raises(InputError, match=r"^later must return a goal of the level, .* not <coroutine"):
        take_turn(make_meta(f"{outside}:later"), make("a", 2))
    gc.collect()
    assert not recwarn.list


ALL_METHODS = {
    "reset": "None",
    "choose": "np.zeros(len(_[1]), int)",
    "observe": "None",
    "learn": "None",
    "state_dict": "{}",
    "load_state_dict": "None",
    "for_play": "self",
    "statistics": "{'gain': 1}",
}


@pytest.mark.parametrize("method", [name for name in ALL_METHODS if name != "load_state_dict"])
def test_a_method_that_fails_raises_input_error_with_its_line(outside, method, tmp_path):
    """In training, which runs them all; an error of ours would keep its traceback."""
    lines = [*textwrap.dedent(MINE).splitlines(), "class Failing(Mine):"]
    for name, result in ALL_METHODS.items():
        body = "open('/nowhere/to/be/found')" if name == method else result
        lines += ["    @property"] * (name == "statistics")
        lines += [f"    def {name}(self, *_, **__):", f"        return {body}"]
    (tmp_path / f"{outside}_fails.py").write_text("\n".join(lines))
    config = TrainConfig(EnvConfig("a", size=11, max_steps=4), num_envs=4, steps=256, evaluations=1)
    config = config.changed(meta=f"{outside}_fails:Failing", minibatches=2, sequence_length=8, evaluation_episodes=4)
    number = next(n for n, line in enumerate(lines, start=1) if "open" in line)
    with pytest.raises(InputError) as caught:
        run_session(*begin(config, tmp_path / "run"))
    assert "Failing" in str(caught.value)
    assert " fails: FileNotFoundError: " in str(caught.value)
    assert str(caught.value).endswith(f"(line {number} of {tmp_path / outside}_fails.py)")
    assert "\n" not in str(caught.value)


class Saying:
    def __init__(self, said):
        self.said = said

    def choose(self, observations, legal, situation):
        return self.said


@pytest.mark.parametrize(
    ("said", "what"),
    [
        (np.zeros(2, np.int64), "an array of int64 and shape (2,)"),
        (np.zeros(3), "an array of float64 and shape (3,)"),
        (0, "an array of int64 and shape ()"),
        (None, "an array of object and shape ()"),
        (["red key"] * 3, "an array of <U7 and shape (3,)"),
    ],
)
def test_an_invalid_choice_raises_input_error(said, what):
    start = (
        "the meta-controller's choice must be 3 goal ids "
        "(whole numbers, one for each environment whose turn it is), not "
    )
    with pytest.raises(InputError, match=f"^{re.escape(start + what)}$"):
        take_turn(Saying(said), make("a", 3))


class Diary:
    def __init__(self):
        self.begun, self.asked = [], []

    def reset(self, envs):
        self.begun.append(envs.tolist())

    def choose(self, observations, legal, situation):
        self.asked.append(situation.envs.tolist())
        assert {len(values) for values in observations.values()} == {len(situation)} == {len(legal)}
        assert legal.shape == (len(situation), 13)
        assert observations["action_mask"][:, :13].astype(bool).tolist() == legal.tolist()
        return legal.argmax(axis=1)


def test_a_meta_controller_chooses_after_each_option_and_is_reset_with_each_episode():
    turns, diary = make("a", 3, max_steps=10, subgoal_horizon=4), Diary()
    turns.world._state.levels["steps"] = [0, 0, 6]
    for _ in range(11):
        take_turn(diary, turns)
        turns.step([1, 1, 1])
    take_turn(diary, turns)
    # Environments 0 and 1 end after 10 steps; environment 2 after 4, just as its option does, and again after 14.
    assert diary.begun == [[0, 1, 2], [2], [0, 1]]
    assert diary.asked == [[0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 1]]


def nearest_by_hand(turns):
    """Rows plus columns from the agents to the keys and doors; the nearest of the legal goals, or -1."""
    levels, situation = turns.world.state.levels, turns.situation(np.arange(len(turns)))
    places = situation.by_goal(
        *(levels["keys_at"] @ (100, 1), levels["doors_at"] @ (100, 1)), levels["exit_at"] @ (100, 1)
    )
    row, col = np.divmod(places, 100)
    distances = abs(row - levels["row"][:, None]) + abs(col - levels["col"][:, None])
    nearest = np.where(situation.legal, distances, 1000).argmin(axis=1)
    return np.where(situation.legal.any(axis=1), nearest, -1).tolist()


NEAREST = {
    "goal": lambda level: min(level.legal_goals, key=lambda goal: goal.distance),
    "id": lambda level: min(level.legal_goals, key=lambda goal: goal.distance).id,
    "numpy id": lambda level: np.int8(min(level.legal_goals, key=lambda goal: goal.distance).id),
    "by name": "{outside}:nearest",
}


@pytest.mark.parametrize("goal_mask", ["reachable", "seen"])  # under the second, some levels have no legal goal
@pytest.mark.parametrize("function", NEAREST)
def test_a_plain_function_from_a_level_to_a_goal(outside, function, goal_mask):
    function = NEAREST[function].format(outside=outside) if function == "by name" else NEAREST[function]
    rng, meta, given = np.random.default_rng(0), make_meta(function), set()
    turns = make("e", 30, size=19, goal_mask=goal_mask, subgoal_horizon=5, max_steps=50)
    for _ in range(60):
        expected = np.where(turns.ledger.is_meta_turn, nearest_by_hand(turns), turns.goals)
        take_turn(meta, turns)
        assert turns.goals.tolist() == expected.tolist()
        given |= set(expected.tolist())
        turns.step(rng.choice([0, 0, 1, 2, 3, 4], size=30))
    assert len(given) > 8
    assert (-1 in given) == (goal_mask == "seen")
    assert not turns.ledger.illegal_goals.any()


@pytest.mark.parametrize("said", [None, -1, 13])
def test_a_plain_function_may_choose_no_goal(said):
    turns = make("a", 3, goal_mask="none")
    take_turn(make_meta(lambda level: said), turns)
    assert turns.goals.tolist() == [-1] * 3


@pytest.mark.parametrize("bad", [True, 99, -7, 1.0, "red key", [0], np.zeros(13), np.zeros((2, 2)), {"goal": 1}])
def test_an_invalid_choice_of_a_plain_function_raises_input_error(bad):
    def choose_badly(level):
        return bad

    for function in (choose_badly, lambda level: bad):
        said = f"{function.__name__} must return a goal of the level, a goal id (0 to 12) or None, not "
        with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
            take_turn(make_meta(function), make("a", 3))
        assert "\n" not in str(caught.value)


class Watcher:
    def __init__(self):
        self.seen = []

    def choose(self, observations, legal, situation):
        return legal.argmax(axis=1)

    def observe(self, step, turns):
        assert turns.last_step is step
        self.seen.append((step.actions.copy(), step.lengths.copy(), turns.world.state.levels["steps"].copy()))


def check_watched(seen, n_envs, n_steps):
    assert len(seen) == n_steps
    clocks = np.zeros(n_envs, int)
    for _, lengths, begun in seen:
        np.testing.assert_array_equal(lengths, clocks + 1)
        clocks = np.where(lengths == 9, 0, clocks + 1)  # episodes of 9 steps
        np.testing.assert_array_equal(begun, clocks)


def test_one_that_watches_sees_every_step_in_training():
    trainer = Trainer(TrainConfig(num_envs=4, steps=400).changed(size=11, max_steps=9, meta="random"))
    trainer.turns.reset(0)  # without the staggered clocks
    watcher = Watcher()
    trainer.agents[META] = ScriptedAgent(watcher, is_training=True)
    while not trainer.is_done:
        trainer.advance()
    check_watched(watcher.seen, 4, trainer.steps // 4)


def test_one_that_watches_sees_every_step_of_the_gymnasium_environments():
    one, many = Watcher(), Watcher()
    single = EscapeRoom("c", size=11, max_steps=9, meta=one)
    single.reset(seed=0)
    for _ in range(9):
        single.step(1)
    assert [lengths.item() for _, lengths, _ in one.seen] == list(range(1, 10))
    rooms = EscapeRooms(3, "c", size=11, max_steps=9, meta=many, autoreset_mode="SameStep")
    rooms.reset(seed=0)
    for _ in range(25):
        rooms.step(np.ones(3, int))
    check_watched(many.seen, 3, 25)


def test_memory_that_no_checkpoint_holds_is_named():
    class Saved(Watcher):
        def state_dict(self):
            return {}

        def load_state_dict(self, state):
            pass

    class Plain:
        def choose(self, observations, legal, situation):
            return legal.argmax(axis=1)

    assert unsaved_memory(Watcher()) == "the method observe and attributes (seen)"
    assert unsaved_memory(make_meta(Plain())) is None
    assert unsaved_memory(Saved()) is None
    assert unsaved_memory(make_meta(lambda level: None)) is None
    for name in META_CONTROLLERS:
        assert unsaved_memory(make_meta(name)) is None
