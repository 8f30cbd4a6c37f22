"""A user's own environment as a world."""

import sys
from dataclasses import replace
from types import ModuleType

import chest_task
import gymnasium
import numpy as np
import pytest
from chest_task import GOALS, LEFT, RIGHT, USE, Chest, chest, dice, free
from gymnasium import spaces

import hierroom
from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules
from hierroom.meta import make_meta, take_turn
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.worlds.dependencies import Dependencies
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import name_in_module

COIN_GOAL, KEY_GOAL, CHEST_GOAL = range(3)
TO_CHEST = [RIGHT] * 3 + [USE, RIGHT, USE]
"""From cell 0 to the key, then to the chest."""


def make(task=chest, n=1, seed=0, **settings):
    return Turns(EnvConfig(task=task, **settings), n, seed=seed)


def cells(turns):
    return turns.world.shown(turns.world.everywhere)["place"].tolist()


def noise(turns):
    """Return the number that each episode draws anew."""
    return turns.world.shown(turns.world.everywhere)["observation_goal"].tolist()


def play(turns, actions):
    """Let all environments take the same actions; return the steps."""
    return [turns.step([action] * len(turns)) for action in actions]


def from_cell(cell, task=chest, **settings):
    """Return one environment that starts in the cell."""
    return next(turns for seed in range(99) if cells(turns := make(task, seed=seed, **settings)) == [cell])


def test_goal_is_achieved_when_its_function_value_grows():
    steps = play(from_cell(0), [RIGHT, USE, USE, RIGHT, RIGHT, USE, USE, RIGHT, USE])
    achieved = [np.flatnonzero(step.achieved[0]).tolist() for step in steps]
    assert achieved == [[], [COIN_GOAL], [COIN_GOAL], [], [], [KEY_GOAL], [], [], [CHEST_GOAL]]
    assert [int(step.n_first[0]) for step in steps] == [0, 1, 0, 0, 0, 1, 0, 0, 1]
    assert [bool(step.episode_ended[0]) for step in steps] == [False] * 8 + [True]
    last = steps[-1]
    assert (last.success[0], last.terminated[0], last.extrinsic[0]) == (True, True, 1.0)


def test_termination_is_no_success_and_max_steps_truncates():
    fallen, cut = play(from_cell(0), [LEFT])[-1], play(from_cell(0, max_steps=2), [USE, USE])[-1]
    assert (fallen.terminated[0], fallen.truncated[0], fallen.success[0]) == (True, False, False)
    assert (cut.terminated[0], cut.truncated[0], cut.success[0]) == (False, True, False)


def legal(turns):
    """Return the goals that the meta-controller of the only environment could choose on its turn."""
    mask = turns.world.legal_goals("reachable", np.array([True]))
    return [["coin", "key", "chest"][goal] for goal in np.flatnonzero(mask[0, :-1])]


def test_goals_are_legal_if_their_rule_changes_something():
    turns = from_cell(0)
    found = [legal(turns)]
    for action in [RIGHT, USE, USE, RIGHT, RIGHT, USE]:
        play(turns, [action])
        if action == USE:
            found.append(legal(turns))
    assert found == [["coin", "key"], ["coin", "key"], ["key"], ["chest"]]
    level = turns.world.exact_view(np.arange(1)).level(0, turns.world.legal_goals("reachable", np.array([True]))[0])
    assert str(level) == "step 6; achieved: coin 2 times, key 1 times; legal goals: chest"
    assert level.facts == {"coin": 2, "key": 1, "chest": 0}
    assert np.flatnonzero(turns.world.legal_goals("existing", np.array([True]))[0]).tolist() == [0, 2]
    assert turns.world.legal_goals("none", np.array([True]))[0].tolist() == [True] * 3 + [False]
    with pytest.raises(InputError, match="goal_mask of chest_task:chest is one of reachable, existing, none, not seen"):
        turns.world.legal_goals("seen", np.array([True]))


def test_without_rules_achieved_boolean_goals_become_illegal():
    turns = from_cell(0, free)
    assert legal(turns) == ["coin", "key", "chest"]
    play(turns, TO_CHEST[:4])
    assert legal(turns) == ["coin", "chest"]


def test_goal_true_at_reset_is_in_the_marking():
    """Otherwise HiPPO could pursue a goal that cannot become true, as the rules decide which goals are legal."""
    held = {"key": lambda env, info: True, "chest": GOALS["chest"], "coin": lambda env, info: 5}
    task = replace(chest, goals=held)
    turns = make(task, 3)
    assert turns.world.markings.tolist() == [[2, 1, 0]] * 3  # coin, key, chest: the capacity is 2, 1, 1
    assert turns.world.legal_goals("reachable", np.ones(3, bool))[0].tolist() == [False, True, False, False]
    assert not turns.world.counts.any()
    other = make(task, 3, seed=1)
    other.world.set_arrays(turns.world.get_arrays(np.arange(3)))
    assert other.world.markings.tolist() == turns.world.markings.tolist()
    with pytest.warns(UserWarning, match="the target 'chest' of lid is true at a reset"):
        make(replace(chest, goals={**GOALS, "chest": lambda env, info: np.True_}, label="lid"))


@pytest.mark.parametrize("order", [("wood", "table"), ("table", "wood")])
def test_applicable_goals_of_one_step_apply_first(order):
    rules = {"wood": {"gives": "wood"}, "table": {"uses": "wood", "gives": "table"}}
    goals = GoalSet.one_hot(order, "table")
    dependencies = Dependencies(Rules({name: rules[name] for name in order}, "table", {"wood": 9}), goals)
    markings, n_wood = dependencies.rules.start_marking[None].copy(), 10**9
    dependencies.apply(markings, np.array([[n_wood if name == "wood" else 1 for name in order]]))
    assert dependencies.in_words(markings[0].tolist()) == {"wood": 9 if order[0] == "table" else 8, "table": 1}


def test_fixed_dfs_pursues_needed_goals_before_the_target():
    turns, meta, given = from_cell(0), make_meta("fixed-dfs"), []
    for action in TO_CHEST:
        take_turn(meta, turns)
        given.append(int(turns.goals[0]))
        play(turns, [action])
    assert given == [KEY_GOAL] * 4 + [CHEST_GOAL] * 2


def test_task_episodes_do_not_depend_on_num_envs():
    many, own = make(n=5, seed=3), make(seed=3, env_index=2)
    for action in [RIGHT, USE, RIGHT, RIGHT, USE] * 15:
        step, one = play(many, [action])[0], play(own, [action])[0]
        assert many.world.shown(np.array([2]))["observation_goal"] == own.world.shown(np.array([0]))["observation_goal"]
        assert step.episode_ended[2] == one.episode_ended[0]
    assert len({*noise(many)}) > 1
    assert noise(make(seed=3, levels="evaluation")) != noise(make(seed=3))


def test_set_state_replays_the_episode():
    turns = make(n=3, seed=5)
    play(turns, [RIGHT, USE, RIGHT])
    state = turns.get_state()
    later = [step.records.copy() for step in play(turns, [RIGHT, USE, RIGHT, USE] * 9)]
    other = make(n=3, seed=99)
    other.set_state(state)
    assert other.world.notes == turns.world.notes
    for step, then in zip(play(other, [RIGHT, USE, RIGHT, USE] * 9), later, strict=True):
        assert step.records.tolist() == then.tolist()


def test_nondeterministic_episode_is_truncated_with_a_note():
    turns = make(dice, n=20)
    play(turns, [RIGHT, USE, RIGHT])
    state = turns.get_state()
    turns.set_state(state)
    assert turns.world.notes[-1].endswith("anew: its episodes do not repeat themselves, or are too long to be saved")
    (step,) = play(turns, [USE])
    assert 0 < step.truncated.sum() < 20
    assert (step.lengths == 4).all()


@pytest.mark.parametrize("is_late", [True, False])
def test_replay_that_achieves_other_goals_warns(is_late):
    later = []
    goals = {"moved": lambda env, info: bool(info) and bool(later) == is_late}
    task = hierroom.Task(Chest, goals, target="moved", max_steps=9, label=f"chest {is_late}")
    episode = next(hierroom.rollout("random", EnvConfig(task=task), 1))
    assert episode.success != is_late
    later.append(True)
    with pytest.warns(UserWarning, match=r"^a replay of chest \w+ achieves other goals than the episode: its seed"):
        list(episode.states(drawn=()))


def test_recorded_episode_is_replayed_and_drawn():
    (episode,) = hierroom.rollout("random", EnvConfig(task=chest), 1, seed=4)
    states = list(episode.states())
    assert len(states) == len(episode) + 1
    assert states[-1].counts.tolist() == np.bincount([event.goal for event in episode.events], minlength=3).tolist()
    achieved, marking = episode.replayer.rules_state(states[-1])
    assert achieved.tolist() == (states[-1].counts > 0).tolist()
    assert marking.tolist() == np.minimum(states[-1].counts, [2, 1, 1]).tolist()
    pictures = [episode.replayer.picture(state, KEY_GOAL, 1, "a title") for state in states[:2]]
    assert pictures[0].shape == pictures[1].shape
    assert pictures[0].shape[1] > 60
    assert (pictures[0][:40, :60] % 40 == 0).all()
    assert episode.replayer.text(states[0], KEY_GOAL).splitlines()[1] == "> [ ] key"
    assert episode.title.startswith("task chest_task:chest, seed 4, environment 0, episode 0: ")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"make": 3}, "make of a task is a function that makes its environment or an id, not 3"),
        ({"goals": {"chest": True}}, "goal 'chest' must be a function of environment and info, not True"),
        ({"target": "gold"}, "the target must be one of the goals coin, key, chest, or None, not 'gold'"),
        ({"rules": {"coin": {}}}, "these lack 'key', 'chest'"),
        ({"max_steps": 0}, "max_steps must be at least 1, not 0"),
        ({"vectors": {"coin": [1.0]}}, "vectors of a task are equally many finite numbers for each goal"),
        ({"rules": None, "capacity": {"coin": 2}}, "there are no rules"),
        ({"rules": replace(chest.rules, target="key")}, "target 'chest' does not give the target of its rules, 'key'"),
        ({"label": "two\nlines"}, "the label of a task must be a text of one line, not 'two"),
    ],
)
def test_invalid_task_raises_input_error(changes, said):
    arguments = {"make": Chest, "goals": GOALS, "rules": chest_task.RULES, "target": "chest"}
    with pytest.raises(InputError) as refused:
        hierroom.Task(**{**arguments, **changes})
    assert said in str(refused.value)


class Named(Chest):
    """A chest with entries that are named like others of an observation or like features, and an empty one."""

    names = ("goal", "features", "choice", "symbol", "goal-status", "plain")
    observation_space = spaces.Dict({"empty": spaces.Box(0, 1, (0,)), **{name: spaces.Discrete(9) for name in names}})

    def _observation(self):
        return {"empty": np.zeros(0, np.float32), **{name: 3 + n for n, name in enumerate(self.names)}}


def test_entries_named_like_features_are_renamed():
    task = hierroom.Task(make=Named, goals=GOALS, target="chest")
    env = hierroom.add_features(hierroom.parallel_env(task), task.controller_features)
    observations, _ = env.reset(seed=0)
    seen = observations["controller_0"]
    assert [int(seen[f"observation_{name}"]) for name in Named.names[:-1]] + [int(seen["plain"])] == [3, 4, 5, 6, 7, 8]
    assert sorted(seen["features"].tolist()) == [3, 3, 3, 4, 5, 6, 7, 8]  # also no goal, and no action before
    assert task.trial.left_out == ["empty"]


class Modeless(Chest):
    metadata = {"render_modes": []}  # noqa: RUF012 - Gymnasium reads it from the class

    def __init__(self):
        super().__init__()


class Fixed(Modeless):
    render_mode = property(lambda env: "rgb_array")

    def __init__(self):
        self.is_random = False


class Plain(Chest):
    __init__, is_random = object.__init__, False


gymnasium.register("Modeless-v0", Modeless)
gymnasium.register("Passing-v0", lambda **entries: Modeless(**entries))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "make",
    ["Modeless-v0", "Passing-v0", Modeless, Plain, lambda: Modeless(), Fixed, lambda render_mode: Chest(render_mode)],
)
def test_render_mode_is_passed_on_where_it_is_taken(make):
    task = hierroom.Task(make=make, goals=GOALS, target="chest")
    play(Turns(EnvConfig(task=task), 1, seed=0), [RIGHT])
    assert task.new_env("rgb_array").unwrapped.render_mode == (None if isinstance(make, str) else "rgb_array")
    with pytest.raises(InputError, match="make of task fails: TypeError: "):
        hierroom.Task(make=lambda render_mode: 0 + "", goals=GOALS, target="chest").new_env("rgb_array")


def test_name_in_module_finds_the_tasks_variable():
    assert name_in_module(chest) == "chest_task:chest"
    sys.modules["a_script"] = ModuleType("a_script")
    sys.modules["a_script"].chest = chest  # imported there, and earlier in the alphabet
    assert name_in_module(chest) == "chest_task:chest"
    del sys.modules["a_script"]
    sys.modules["__main__"].own = sys.modules["__mp_main__"].own = own = replace(chest)
    with pytest.warns(UserWarning, match="only this process can open runs of own"):
        assert name_in_module(own) == "__main__:own"
    del sys.modules["__main__"].own
    with pytest.raises(InputError, match="no module has a name for task"):
        name_in_module(replace(chest))


def test_environments_in_several_processes_play_the_same_episodes():
    here, elsewhere = make(n=5, seed=3), make(replace(chest, processes=2), n=5, seed=3)
    for action in [RIGHT, USE, RIGHT, RIGHT, USE] * 4:
        step, other = play(here, [action])[0], play(elsewhere, [action])[0]
        assert step.records.tolist() == other.records.tolist()
        shown, other = (turns.world.shown(turns.world.everywhere) for turns in (here, elsewhere))
        for name, values in shown.items():
            np.testing.assert_array_equal(values, other[name], strict=True)
