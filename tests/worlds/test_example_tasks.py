"""The tasks in examples/tasks: their goals fire when they should, and their rules agree with play."""

from copy import deepcopy
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from crafting_stand_in import Crafting
from minigrid.core.actions import Actions

import hierroom

TASKS = Path(__file__).parents[2] / "examples" / "tasks"


@pytest.fixture(autouse=True)
def in_tasks(monkeypatch):
    monkeypatch.syspath_prepend(TASKS)


def level_task(name):
    import minigrid_levels

    return getattr(minigrid_levels, name)


class Played:
    """A level of a task, where a test can place the agent in front of things."""

    def __init__(self, name):
        self.task = level_task(name)
        self.env = self.task.new_env()
        self.info = self.env.reset(seed=3)[1]
        self.level = self.env.unwrapped

    def achieved(self):
        return {goal for goal, function in self.task.goals.items() if function(self.env, self.info)}

    def where(self, kind):
        """The cell of the only thing of a kind."""
        width, things = self.level.grid.width, self.level.grid.grid
        ((col, row),) = [(n % width, n // width) for n, thing in enumerate(things) if thing and thing.type == kind]
        return col, row

    def act(self, action, cell):
        """Act on the cell to the right of the agent."""
        self.level.agent_pos, self.level.agent_dir = (cell[0] - 1, cell[1]), 0
        *_, terminated, _, self.info = self.env.step(action)
        return self.achieved(), terminated


def test_unlock_pickup_goals_fire_in_their_steps():
    played = Played("unlock_pickup")
    key, door, box = played.where("key"), played.where("door"), played.where("box")
    assert played.achieved() == set()
    assert played.act(Actions.toggle, door) == (set(), False)
    assert played.act(Actions.pickup, key) == ({"key"}, False)
    assert played.act(Actions.pickup, box) == ({"key"}, False)  # the hands are full
    assert played.act(Actions.drop, key) == (set(), False)
    played.act(Actions.pickup, key)
    assert played.act(Actions.toggle, door) == ({"key", "unlock"}, False)
    assert played.act(Actions.toggle, door) == ({"key", "unlock"}, False)  # closed, and not locked
    assert played.act(Actions.drop, key) == ({"unlock", "drop"}, False)
    assert played.act(Actions.pickup, box) == ({"unlock", "box"}, True)


def test_key_corridor_goals_fire_in_their_steps():
    played = Played("key_corridor")
    rooms = [room for row in played.level.room_grid for room in row]
    doors = {door.cur_pos: door for room in rooms for door in room.doors if hasattr(door, "is_locked")}
    closed = next(cell for cell, door in doors.items() if not door.is_locked)
    locked = next(cell for cell, door in doors.items() if door.is_locked)
    assert played.act(Actions.toggle, closed) == ({"door"}, False)
    assert played.act(Actions.pickup, played.where("key")) == ({"door", "key"}, False)
    assert played.act(Actions.toggle, locked) == ({"door", "key", "unlock"}, False)
    free = next((x, y) for x in range(1, 7) for y in range(1, 7) if played.level.grid.get(x, y) is None)
    assert played.act(Actions.drop, free) == ({"door", "unlock", "drop"}, False)
    assert played.act(Actions.pickup, played.where("ball")) == ({"door", "unlock", "ball"}, True)


GOALS = ["go to forest", "go to shore", "get wood", "place raft", "place raft, go to island", "get flag"]


def crafting_task(target="get flag"):
    from hierarchycraft import task_of

    return task_of(Crafting, target, max_steps=60)


def test_hierarchycraft_transformations_become_the_targets_rules():
    task = crafting_task()
    assert [*task.goals] == GOALS
    rules = task.rules.to_dict()
    assert rules["rules"]["get wood"] == {"needs": {"axe": 1, "at forest": 1}, "gives": {"wood": 2}}
    assert rules["rules"]["get flag"] == {
        "needs": {"flag in island": 1, "at island": 1},
        "uses": "flag in island",
        "gives": {"flag": 1, "get flag": 1},
    }
    (sail,) = task.rules.rules["place raft, go to island"]
    assert (sail.uses, sail.gives) == ({"raft in shore": 1, "at shore": 1}, {"raft in island": 1, "at island": 1})
    (forest,) = [way for way in task.rules.rules["place raft"] if "raft in forest" in way.gives]
    assert (forest.needs, forest.uses) == ({"wood": 2, "at forest": 1}, {"wood": 2})
    assert (rules["capacity"], rules["start"]) == ({"wood": 2}, {"axe": 1, "at shore": 1, "flag in island": 1})
    assert "get wood" not in crafting_task("go to forest").goals
    with pytest.raises(ValueError, match=r"the target is one of go to forest, .*; not 'get gold'"):
        crafting_task("get gold")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "module", "name"),
    [
        ("crafter", "crafter_symbols", "crafter"),
        ("gymnasium_robotics", "point_maze", "maze"),
        ("minihack", "minihack_rooms", "key_room"),
        ("ale_py", "montezuma", "montezuma"),
    ],
)
def test_known_environments_begin_as_their_seed_says_with_every_goal_ahead(package, module, name):
    pytest.importorskip(package)
    task = getattr(import_module(module), name)
    env = task.new_env()
    observation, info = deepcopy(env.reset(seed=3))
    assert env.observation_space.contains(observation)
    assert [goal for goal, is_achieved in task.goals.items() if is_achieved(env, info)] == []
    for _ in range(3):
        env.step(env.action_space.sample())
    np.testing.assert_equal(env.reset(seed=3)[0], observation)
    assert np.isfinite(hierroom.complexity.analyze(task.rules).expected_steps)


@pytest.mark.slow
def test_crafters_rules_follow_from_its_data():
    pytest.importorskip("crafter")
    rules = import_module("crafter_symbols").rules()
    assert rules["collect_stone"] == {"needs": ["make_wood_pickaxe"]}
    assert rules["place_stone"] == {"needs": [], "uses": {"collect_stone": 1}}
    assert rules["make_iron_sword"]["needs"] == ["place_table", "place_furnace"]
