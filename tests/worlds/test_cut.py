"""Code above the worlds does not import EscapeRoom and runs in another world."""

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
KNOWS_LEVELS = {
    *("lab/report/replay.py", "lab/play/app.py", "lab/play/board.py", "lab/play/game.py"),  # draw or play them
    "runs/rehearsal.py",  # compiles their solver
}


def knows_escape_room(path):
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return any(name.startswith("hierroom.worlds.escape_room") for name in names)


def test_only_what_draws_plays_or_compiles_a_level_imports_the_escape_room():
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


def test_of_several_goals_in_a_step_each_is_achieved_and_the_event_is_the_one_pursued(make):
    turns = make(4, reward="bonus")
    choose(turns, [STONE, LAMP, END, NO_GOAL])
    assert not turns.step([AHEAD] * 4).achieved.any()
    step = turns.step([AHEAD] * 4)
    assert step.achieved.tolist() == [[True, True, False]] * 4
    assert step.events.tolist() == [STONE, LAMP, STONE, STONE]
    assert step.reached.tolist() == step.option_ended.tolist() == [True, True, False, True]
    assert step.outcomes[[0, 1, 3]].tolist() == [REACHED] * 3
    assert step.n_first.tolist() == step.rewards.tolist() == [2] * 4


def test_a_goal_that_is_achieved_again_is_reached_but_no_first(make):
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


def test_an_option_without_its_goal_knows_the_goal_it_achieved_first(make):
    turns = make(1, max_steps=3, reward="intrinsic")
    choose(turns, [END])
    for _ in range(3):
        step = turns.step([AHEAD])
    assert step.truncated.all()
    assert step.outcomes.tolist() == [OTHER]
    assert step.achieved_instead.tolist() == [STONE]


def test_fixed_dfs_pursues_what_the_view_ranks_highest_among_the_reachable(make):
    turns, meta, given = make(3), make_meta("fixed-dfs"), []
    for _ in range(8):
        take_turn(meta, turns)
        given.append(turns.goals.tolist())
        step = turns.step([AHEAD] * 3)
    assert given == [[END] * 3] * 8
    assert step.meta_elapsed.tolist() == [3] * 3  # of the second episode


def test_agents_observe_what_the_world_shows(make):
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


def test_episodes_and_states_are_those_of_the_world(make):
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
