"""User code cannot write to the arrays it gets: compiled code could then read out of bounds."""

import copy
import pickle
from operator import attrgetter

import numpy as np
import pytest
from chest_task import chest
from turns_helpers import make

import hierroom
from hierroom import InputError
from hierroom.gym_env import EscapeRoom
from hierroom.meta import show_step, take_turn
from hierroom.turns.records import AGENTS, CONTROLLER
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

EVERYWHERE = np.arange(3)


def of_step(path):
    return lambda step, turns: attrgetter(path)(step)


def of_turns(path):
    return lambda step, turns: attrgetter(path)(turns)


SITUATION = "envs masks legal goals uniforms meta_turns previous_actions view.levels key_rooms colours tiles".split()  # noqa: SIM905
OF_SITUATION = {path: attrgetter(path) for path in (*SITUATION, "state.grids", "goal_set.vectors")}
OF_STEP = {path: of_step(path) for path in ("records", "rewards", "option_ended", "before.levels", "after.grids")}
OF_TURNS = {path: of_turns(path) for path in ("goals", "ledger.records", "ledger.is_meta_turn", "last_step.goals")}
OF_TURNS |= {"levels": of_turns("world.state.levels"), "grids": of_turns("world.state.grids")}
OF_TURNS |= {path: of_turns(f"world.{path}") for path in ("outcomes", "finals", "everywhere", "goals.kind_of")}
OF_TURNS |= {
    "a level": lambda step, turns: turns.world.state.levels[0].key_rooms,
    "clocks": lambda step, turns: turns.world.clocks(),
    "last records": lambda step, turns: turns.last_step.records["goals"],
    "controller's view": lambda step, turns: turns.observe(CONTROLLER, turns.due(CONTROLLER)).view.levels["direction"],
    "controller's goals": lambda step, turns: turns.observe(CONTROLLER, turns.due(CONTROLLER)).goals,
    "view of some": lambda step, turns: turns.observe(CONTROLLER, np.array([1])).view.tiles,
    "final view": lambda step, turns: turns.final_observation(CONTROLLER, step, EVERYWHERE).view.levels["direction"],
    "meta's view": lambda step, turns: turns.situation(EVERYWHERE).view.levels["key_rooms"],
    "numbers of a feature": lambda step, turns: turns.world.features["view-ids"].vectors,
}
OF_WORKSHOPS = {
    **{path: attrgetter(f"world.{path}") for path in ("state.things", "state.shops", "outcomes", "rules.limits")},
    "recipes": attrgetter("world.book.recipes.goals"),
    "clocks": lambda turns: turns.world.clocks(),
    "controller's view": lambda turns: turns.observe(CONTROLLER, turns.due(CONTROLLER)).view.things,
    "view of some": lambda turns: turns.observe(CONTROLLER, np.array([1])).view.shops["achieved"],
    "meta's view": lambda turns: turns.situation(EVERYWHERE).view.things,
    "final view": lambda turns: turns.final_observation(CONTROLLER, turns.last_step, EVERYWHERE).view.things,
}
OF_TASKS = {
    **{p: attrgetter(f"world.{p}") for p in ("counts", "markings", "lengths", "seeds", "outcomes", "rules.limits")},
    "meta's view": lambda turns: turns.situation(EVERYWHERE).view.entries["place"],
    "controller's view": lambda turns: turns.observe(CONTROLLER, turns.due(CONTROLLER)).view.counts,
    "final view": lambda turns: turns.final_observation(CONTROLLER, turns.last_step, EVERYWHERE).view.steps,
}


def write(array):
    array[...] = 120


class Choosing:
    """Writes to something of a situation."""

    def __init__(self, of):
        self.of = of

    def choose(self, observations, legal, situation):
        write(self.of(situation))
        return np.full(len(situation), -1)


class Observing:
    """Writes to something of a step or of turns."""

    def __init__(self, of):
        self.of = of

    def choose(self, observations, legal, situation):
        return np.full(len(situation), -1)

    def observe(self, step, turns):
        write(self.of(step, turns))


class Rewarding:
    """Writes to something of the step that it rewards."""

    def __init__(self, of):
        self.of = of

    def rewards(self, step):
        write(self.of(step, None))
        return np.zeros(len(step.rewards))


def zero_reward(step):
    """A user-defined reward, for which steps keep the states before and after."""
    return np.zeros(len(step.rewards))


@pytest.mark.parametrize("name", OF_SITUATION)
def test_situation_is_read_only(name):
    turns = make("c", 3)
    expected = turns.get_state()
    said = r"^the meta-controller Choosing fails: ValueError: .*read-only \(line \d+ of .*test_read_only\.py\)$"
    with pytest.raises(InputError, match=said):
        take_turn(Choosing(OF_SITUATION[name]), turns)
    state = turns.get_state()
    assert all((state[field] == expected[field]).all() for field in expected)


@pytest.mark.parametrize("name", OF_STEP | OF_TURNS)
def test_observe_gets_a_read_only_step_and_turns(name):
    turns = make("c", 3, reward=zero_reward)
    step = turns.step(np.zeros(3, int))
    expected = turns.get_state(), step.records.copy()
    of = OF_STEP[name] if name in OF_STEP else OF_TURNS[name]
    with pytest.raises(InputError, match=r"^the meta-controller Observing fails: ValueError: .*read-only \(line \d+"):
        show_step(Observing(of), turns)
    state = turns.get_state()
    assert all((state[field] == expected[0][field]).all() for field in state)
    assert (step.records == expected[1]).all()


@pytest.mark.parametrize("again", [lambda turns: turns, copy.deepcopy])
@pytest.mark.parametrize(("task", "of"), [("workshop:3", OF_WORKSHOPS), (chest, OF_TASKS)], ids=["workshop", "task"])
def test_other_worlds_and_their_copies_are_read_only(task, of, again):
    turns, use = Turns(EnvConfig(task=task, max_steps=2), 3, seed=0), np.full(3, 2)
    turns.step(use)
    turns = again(turns)
    turns.step(use)
    assert turns.world.outcomes["length"].tolist() == [2, 2, 2]
    assert turns.world.clocks().tolist() == [0, 0, 0]
    expected = turns.get_state()
    for found in of.values():
        with pytest.raises(InputError, match=r"^the meta-controller Observing fails: ValueError: .*read-only"):
            show_step(Observing(lambda step, turns, found=found: found(turns)), turns)
    state = turns.get_state()
    assert all((state[field] == expected[field]).all() for field in expected)


@pytest.mark.parametrize("name", OF_STEP)
def test_reward_gets_a_read_only_step(name):
    turns = make("c", 3, reward=Rewarding(OF_STEP[name]))
    with pytest.raises(InputError, match=r"^the reward Rewarding fails: ValueError: .*read-only \(line \d+"):
        turns.step(np.zeros(3, int))


@pytest.mark.parametrize("name", OF_TURNS)
def test_writing_player_raises_input_error(name):
    class Writing:
        def step(self, turns):
            step = turns.step(np.zeros(len(turns), int))
            write(OF_TURNS[name](step, turns))
            return step

    episodes = hierroom.rollout(Writing(), EnvConfig("c", size=11, max_steps=5), 3)
    with pytest.raises(InputError, match=r"^the player Writing fails: ValueError: .*read-only \(line \d+"):
        next(episodes)


def test_player_returning_a_foreign_step_raises_input_error():
    others = make("c", 5)

    class Elsewhere:
        def step(self, turns):
            turns.step(np.zeros(len(turns), int))
            return others.step(np.zeros(5, int))

    with pytest.raises(InputError, match=r"^the player Elsewhere must return the Step of its last turns\.step"):
        next(hierroom.rollout(Elsewhere(), EnvConfig("c", size=11, max_steps=5), 3))


@pytest.mark.parametrize(
    "act",
    [
        lambda turns: turns.step(np.zeros(3, int)),
        lambda turns: turns.reset(),
        lambda turns: turns.reset(5),
        lambda turns: turns.world.step(np.zeros(3, int)),
        lambda turns: turns.world.reset(),
        lambda turns: turns.ledger.write_fields({"goals": 120}),
    ],
)
def test_meta_controller_cannot_act_while_observing(act):
    turns = make("c", 3)
    turns.step(np.zeros(3, int))
    watcher = Observing(None)
    watcher.observe = lambda step, turns: act(turns)
    with pytest.raises(InputError, match=r"^the meta-controller Observing fails: RuntimeError: it took a step or"):
        show_step(watcher, turns)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
def test_copied_turns_are_read_only_and_independent(again):
    turns = make("c", 3)
    copied = again(turns)
    for _ in range(3):
        copied.step(np.zeros(3, int))
    assert copied.world.clocks().tolist() == [3, 3, 3]
    assert copied.world.outcomes["length"].tolist() == [3, 3, 3]
    assert turns.world.clocks().tolist() == [0, 0, 0]
    for name in (
        "levels",
        "grids",
        "outcomes",
        "finals",
        "goals",
        "ledger.records",
        "last records",
        "controller's view",
    ):
        with pytest.raises(ValueError, match="read-only"):
            write(OF_TURNS[name](None, copied))


@pytest.mark.parametrize("make_env", [EscapeRoom, lambda **entries: EscapeRooms(3, **entries)])
def test_a_meta_controller_in_an_environment_cannot_write(make_env):
    env = make_env(graph="c", size=11, meta=Observing(OF_TURNS["levels"]))
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"^the meta-controller Observing fails: ValueError: "):
        env.step(0 if isinstance(env, EscapeRoom) else np.zeros(3, int))


def test_each_space_has_its_own_generator():
    one, other = (hierroom.parallel_env("a") for _ in range(2))
    spaces = [env.observation_space(agent)["observation"] for env in (one, other) for agent in AGENTS]
    assert len({id(space) for space in spaces}) == 4
    for n, space in enumerate(spaces):
        space.seed(n)
    drawn = [space.sample() for space in spaces]
    spaces[0].seed(0)
    assert (spaces[0].sample() == drawn[0]).all()
    assert (drawn[0] != drawn[1]).any()
