"""User-defined meta-controllers by name: how they are found and made, and errors in their code as one line."""

import gc
import re
import sys
import textwrap
from pathlib import Path

import pytest
from turns_helpers import make

from hierroom import InputError
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.meta import META_CONTROLLERS, MetaController, make_meta, take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.session import begin, run_session
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


@pytest.mark.parametrize("name", ["Mine", "nearest"])
def test_spec_finds_class_or_function_in_current_folder(outside, name):
    meta = make_meta(f"{outside}:{name}")
    assert isinstance(meta, MetaController)
    turns = make("a", 4)
    take_turn(meta, turns)
    assert turns.goals.tolist() == turns.world.state.levels["colours"][:, 0].tolist()


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("best", "a meta-controller is one of fixed-dfs, random, oracle, none or package.module:Class or :f"),
        ("{outside}_x:Mine", "there is no module '{outside}_x' for the meta-controller '{outside}_x:Mine'"),
        ("{outside}_broken:Mine", "there is no module 'nowhere_to_be_found' for the meta-controller"),
        ("{outside}_typo:Mine", "the meta-controller '{outside}_typo:Mine' cannot be loaded: SyntaxError: "),
        ("{outside}:Yours", "the meta-controller '{outside}:Yours' cannot be loaded: AttributeError: module"),
        ("{outside}:NoChoice", "a meta-controller has a method choose(observations, legal, situation); '{outside}:No"),
        ("{outside}:Forgetful", "a meta-controller that learns needs state_dict and load_state_dict; "),
        ("{outside}:Choosy", "the meta-controller '{outside}:Choosy' cannot be made: TypeError: "),
        ("{outside}:Broken", "the meta-controller '{outside}:Broken' cannot be made: RuntimeError: out of cheese"),
        ("{outside}:Odd", "the meta-controller '{outside}:Odd' cannot be made: Stop: no more (line "),
        ("{outside}:Telling", "statistics of a meta-controller are numbers by name; 'gain' of '{outside}:Telling' is"),
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
def test_changed_working_folder_is_restored_with_a_warning(outside, at, tmp_path):
    name = f"{outside}_{at}"
    leaves = f"import os\nos.chdir({str(tmp_path.parent)!r})"
    code = {"import": leaves, "choose": ""}[at] + "\ndef choose(level):\n" + textwrap.indent(leaves, "    ")
    (tmp_path / f"{name}.py").write_text(code)
    with pytest.warns(UserWarning, match=f"changes the working folder, which is {tmp_path} again$"):
        take_turn(make_meta(f"{name}:choose"), make("a", 2))
    assert Path.cwd() == tmp_path


def test_for_training_and_for_play_refuse_none(outside, monkeypatch):
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


ALL_METHODS = dict.fromkeys(("reset", "observe", "learn", "load_state_dict"), "None")
ALL_METHODS |= {"choose": "np.zeros(len(_[1]), int)", "state_dict": "{}", "for_play": "self"}
ALL_METHODS |= {"statistics": "{'gain': 1}"}


@pytest.mark.parametrize("method", [name for name in ALL_METHODS if name != "load_state_dict"])
def test_a_method_that_fails_raises_input_error_with_its_line(outside, method, tmp_path):
    """In training, which calls all of them; an error in hierroom's code would keep its traceback."""
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
