"""Code above the worlds does not import the EscapeRoom and also runs in another world."""

import ast

import architecture
import numpy as np
import pytest
from corridor import AHEAD, BACK, END, LAMP, STONE, CorridorTask

from hierroom.agents.episode_facts import EpisodeFacts
from hierroom.agents.features import Features
from hierroom.meta import make_meta, take_turn
from hierroom.turns.kernels import NO_GOAL, OTHER, REACHED
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import world_spec

CUT_OFF = ("turns", "agents", "learners", "runs", "envs", "lab")
CUT_OFF_FILES = ("aec_env", "parallel_env", "gym_env", "vector_env", "meta")
KNOWS_LEVELS = {"lab/report/replay.py", "lab/play.py"}
"""Files that draw levels, or play them."""


def knows_escape_room(path):
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return any(name.startswith("hierroom.worlds.escape_room") for name in names)


def test_only_listed_files_import_the_escape_room():
    folders = [path for folder in CUT_OFF for path in (architecture.PACKAGE / folder).rglob("*.py")]
    paths = [*folders, *(architecture.PACKAGE / f"{name}.py" for name in CUT_OFF_FILES)]
    assert {str(path.relative_to(architecture.PACKAGE)) for path in paths if knows_escape_room(path)} == KNOWS_LEVELS


@pytest.fixture
def make():
    """Return a function that makes turns in corridors: stone and lamp are in cell 2, the end is in cell 5."""

    def make(n=1, **settings):
        return Turns(EnvConfig(task=CorridorTask(), **settings), n, seed=0)

    return make


def choose(turns, goals):
    turns.choose(turns.situation(np.arange(len(turns))), goals)


def test_step_achieving_several_goals_reports_the_pursued_goal(make):
    turns = make(4, reward="bonus")
    choose(turns, [STONE, LAMP, END, NO_GOAL])
    assert not turns.step([AHEAD] * 4).achieved.any()
    step = turns.step([AHEAD] * 4)
    assert step.achieved.tolist() == [[True, True, False]] * 4
    assert step.events.tolist() == [STONE, LAMP, STONE, STONE]
    assert step.reached.tolist() == step.option_ended.tolist() == [True, True, False, True]
    assert step.outcomes[[0, 1, 3]].tolist() == [REACHED] * 3
    assert step.n_first.tolist() == step.rewards.tolist() == [2] * 4


def test_goal_achieved_again_is_reached_but_not_first(make):
    turns = make(2, reward="bonus")
    for action in (AHEAD, AHEAD, BACK):
        turns.step([action] * 2)
    turns.ledger.begin_options(np.arange(2), np.array([STONE, LAMP]))
    step = turns.step([AHEAD] * 2)
    assert step.achieved.tolist() == [[True, False, False]] * 2
    assert step.reached.tolist() == [True, False]
    assert step.events.tolist() == [STONE, STONE]
    assert not step.is_first.any()
    assert not step.rewards.any()


def test_achieved_instead_is_the_first_achieved_goal(make):
    turns = make(1, max_steps=3, reward="intrinsic")
    choose(turns, [END])
    for _ in range(3):
        step = turns.step([AHEAD])
    assert step.truncated.all()
    assert step.outcomes.tolist() == [OTHER]
    assert step.achieved_instead.tolist() == [STONE]


def test_fixed_dfs_pursues_the_highest_ranked_reachable_goal(make):
    turns, meta, given = make(3), make_meta("fixed-dfs"), []
    for _ in range(8):
        take_turn(meta, turns)
        given.append(turns.goals.tolist())
        step = turns.step([AHEAD] * 3)
    assert given == [[END] * 3] * 8
    assert step.meta_elapsed.tolist() == [3] * 3  # of the second episode


def test_agents_observe_the_entries_of_the_world(make):
    turns = make(2)
    choose(turns, [LAMP, NO_GOAL])
    turns.step([AHEAD, BACK])
    for agent, goals in (("meta_0", [NO_GOAL, NO_GOAL]), ("controller_0", [LAMP, NO_GOAL])):
        shown = turns.observe(agent, np.arange(2)).as_dict()
        assert shown["cell"].tolist() == [1, 0]
        assert shown["goal"].tolist() == turns.world.goals.vectors[goals].tolist()
        space = turns.observation_space(agent)
        assert all(space.contains({name: array[n] for name, array in shown.items()}) for n in range(2))
    assert str(turns.situation(np.arange(2)).level(0)) == "step 1; achieved: nothing; legal goals: none"
    features = Features(world_spec(turns.config), ("cell", "symbol", "previous-action"))
    assert features.cardinalities == (6, 4, 3)
    assert features.encode(turns.observe("controller_0", np.arange(2))).tolist() == [[1, LAMP, AHEAD], [0, 3, BACK]]


def test_episode_facts_and_states_come_from_the_world(make):
    turns, facts, ended = make(2, max_steps=9), EpisodeFacts(2), []
    actions = np.array([[AHEAD, BACK]] * 12)
    for row in actions[:4]:
        facts.add(turns.step(row), turns)
    state = turns.get_state()
    for row in actions[4:]:
        ended.append(facts.add(turns.step(row), turns))
    first = next(one for one in ended if len(one))
    assert first.milestones == [[(2, STONE), (2, LAMP), (5, END)]]
    assert (first.lengths.tolist(), first.variants) == ([5], ["corridor"])
    turns.set_state(state)
    assert turns.world.cells.tolist() == [4, 0]
    assert turns.step([AHEAD, BACK]).terminated.tolist() == [True, False]
