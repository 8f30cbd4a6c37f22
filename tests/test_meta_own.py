"""Meta-controllers of one's own: how they are found, what they are given, and what is said of wrong ones."""

import re
import sys
import textwrap

import numpy as np
import pytest
from turns_rooms import make

from hierroom import InputError
from hierroom.meta import META_CONTROLLERS, MetaController, make_meta

MINE = """
    import numpy as np

    class Mine:
        def choose(self, observations, legal, situation):
            return np.where(legal.any(axis=1), legal.argmax(axis=1), -1)

    class NoChoice:
        pass

    class Forgetful(Mine):
        def learn(self, step, turns):
            pass

        def state_dict(self):
            return {}

    class Choosy:
        def __init__(self, taste):
            self.taste = taste

    class Broken:
        def __init__(self):
            raise RuntimeError("out of\\ncheese")
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
    turns.ask(meta)
    assert turns.goals.tolist() == turns.world.state.levels["colours"][:, 0].tolist()


def test_an_entry_point_of_an_installed_package(outside, tmp_path, monkeypatch):
    installed = tmp_path / "lucky-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: lucky\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(f"[hierroom.meta_controllers]\nlucky = {outside}:Mine\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert type(make_meta("lucky")).__name__ == "Mine"


def test_a_meta_controller_itself():
    mine = META_CONTROLLERS["random"]()
    assert make_meta(mine) is mine


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("best", "a meta-controller is one of fixed-dfs, random, oracle, none, "),
        ("", "a meta-controller is one of fixed-dfs, random, oracle, none, "),
        ("{outside}_x:Mine", "there is no module '{outside}_x' for the meta-controller '{outside}_x:Mine'"),
        ("{outside}_broken:Mine", "there is no module 'nowhere_to_be_found' for the meta-controller"),
        ("{outside}_typo:Mine", "the meta-controller '{outside}_typo:Mine' cannot be loaded: SyntaxError: "),
        (":Mine", "the meta-controller ':Mine' cannot be loaded: ValueError: Empty module name"),
        ("{outside}:", "the meta-controller '{outside}:' cannot be loaded: AttributeError: module '{outside}' has no"),
        ("{outside}:Yours", "the meta-controller '{outside}:Yours' cannot be loaded: AttributeError: module"),
        ("{outside}:NoChoice", "a meta-controller has a method choose(observations, legal, situation); '{outside}:No"),
        ("{outside}:Forgetful", "a meta-controller that learns has the methods state_dict and load_state_dict too"),
        ("{outside}:Choosy", "the meta-controller '{outside}:Choosy' cannot be made: TypeError: "),
        ("{outside}:Broken", "the meta-controller '{outside}:Broken' cannot be made: RuntimeError: out of cheese"),
        (7, "a meta-controller has a method choose(observations, legal, situation); 7 has none"),
        (META_CONTROLLERS["random"], "a meta-controller is an object, not a class: make one of RandomGoals"),
    ],
)
def test_wrong_ones_are_one_clear_line(outside, spec, said):
    if isinstance(spec, str):
        spec, said = spec.format(outside=outside), said.format(outside=outside)
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        make_meta(spec)
    assert "\n" not in str(caught.value)


class Saying:
    """Returns what it was told to."""

    def __init__(self, said):
        self.said = said

    def choose(self, observations, legal, situation):
        return self.said


@pytest.mark.parametrize(
    ("said", "what"),
    [
        (np.zeros(2, np.int64), "an array of int64 and shape (2,)"),
        (np.zeros((3, 1), np.int64), "an array of int64 and shape (3, 1)"),
        (np.zeros(3), "an array of float64 and shape (3,)"),
        (np.zeros(3, bool), "an array of bool and shape (3,)"),
        (0, "an array of int64 and shape ()"),
        (None, "an array of object and shape ()"),
        (["red key"] * 3, "an array of <U7 and shape (3,)"),
    ],
)
def test_a_wrong_choice_is_one_clear_line(said, what):
    start = "the meta-controller's choice must be 3 goal ids (whole numbers, one for each room whose turn it is), not "
    with pytest.raises(InputError, match=f"^{re.escape(start + what)}$"):
        make("a", 3).ask(Saying(said))


@pytest.mark.parametrize("said", [[0, 1, 2], np.array([0, 1, 2], np.uint8)])
def test_any_whole_numbers_will_do(said):
    turns = make("a", 3, goal_mask="none")
    turns.ask(Saying(said))
    assert turns.goals.tolist() == [0, 1, 2]


class Diary:
    """Writes down what it is asked, and gives the first legal goal."""

    def __init__(self):
        self.begun, self.asked = [], []

    def reset(self, indices):
        self.begun.append(indices.tolist())

    def choose(self, observations, legal, situation):
        self.asked.append(situation.indices.tolist())
        assert {len(values) for values in observations.values()} == {len(situation)} == {len(legal)}
        assert legal.shape == (len(situation), 13)
        assert observations["action_mask"][:, :13].astype(bool).tolist() == legal.tolist()
        return legal.argmax(axis=1)


def test_it_is_asked_when_a_goal_is_over_and_told_when_an_episode_begins():
    turns, diary = make("a", 3, max_steps=10, subgoal_horizon=4), Diary()
    turns.world.state.levels["steps"] = [0, 0, 6]
    for _ in range(11):
        turns.ask(diary)
        turns.step([1, 1, 1])
    turns.ask(diary)
    # Rooms 0 and 1 end after 10 steps; room 2 after 4, just as its option does, and again after 14.
    assert diary.begun == [[0, 1, 2], [2], [0, 1]]
    assert diary.asked == [[0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 1]]
