"""Results that users keep never change, and can be pickled."""

import copy
import pickle

import chest_task
import gymnasium
import numpy as np
import pytest
from api_kinds import ID, KINDS, SETTINGS, actions, begin
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_values import plain
from same_state import equal

import hierroom
from hierroom import EnvConfig, InputError
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns

LENGTHS = (1, 2, 64, 65)  # the recorder's arrays have room for 64 steps at first
WORLDS = {"rooms": {"graph": "a", "size": 11}, "workshop": {"task": "workshop:4"}, "task": {"task": chest_task.chest}}


def passing(step):
    """A reward that differs from step to step."""
    return 10.0 * step.actions + step.lengths


class Player:
    """Plays random actions from ``first`` on, and one that does not exist; from 2 on they end no room and no task."""

    def __init__(self, first, seed):
        self.first, self.random = first, np.random.default_rng(seed)

    def step(self, turns):
        situation = turns.situation(turns.due(META))
        turns.choose(situation, self.random.integers(len(turns.world.goals), size=len(situation)))
        return turns.step(self.random.integers(self.first, turns.world.n_actions + 1, size=len(turns)))


def of_episode(episode):
    return [plain(value) for name, value in vars(episode).items() if name != "replayer"] + [episode.to_dict()]


@pytest.mark.parametrize("world", WORLDS)
@given(
    length=st.sampled_from(LENGTHS),
    first=st.sampled_from((0, 2)),
    sizes=st.tuples(st.integers(1, 9), st.integers(1, 4)),
    observations=st.booleans(),
    seed=st.integers(0, 99),
)
@settings(max_examples=6)
def test_kept_episodes_never_change(world, length, first, sizes, observations, seed):
    config, (episodes, num_envs) = EnvConfig(**WORLDS[world], max_steps=length, reward=passing), sizes
    played = hierroom.rollout(
        Player(first, seed), config, episodes, num_envs=num_envs, seed=seed, observations=observations
    )
    kept = [(episode, of_episode(episode)) for episode in played]
    assert [of_episode(episode) for episode, _ in kept] == [then for _, then in kept]
    if first and world != "workshop":
        assert {len(episode) for episode, _ in kept} == {length}


def play_directly(turns, actions):
    for action in actions:
        situation = turns.situation(turns.due(META))
        turns.choose(situation, np.full(len(situation), action))
        goals, observation = turns.goals, turns.observe(CONTROLLER, turns.due(CONTROLLER))
        step = turns.step(np.full(len(turns), action % turns.world.n_actions))
        last = turns.final_observation(CONTROLLER, step, np.arange(len(turns)))
        states = turns.get_state(), turns.world.get_state(0), turns.world.clocks()
        yield situation, goals, observation, step.records, step.rewards, last, states


def play_with_agent(env, actions):
    agent, state = hierroom.load("b"), None
    observations, infos = env.reset(seed=3)
    for _ in actions:
        chosen, state = agent.act(observations, state, begins=infos["length"] == 0)
        yield chosen, state.decision, state.decision.probabilities
        observations, *_, infos = env.step(chosen)


DIRECT = {
    **{
        name: (
            lambda e=entries, n=n: Turns(EnvConfig(**e, max_steps=7, subgoal_horizon=3), n),
            play_directly,
        )
        for world, entries in WORLDS.items()
        for name, n in ((world, 3), (f"one {world}", 1))
    },
    "agent": (
        lambda: hierroom.add_features(gymnasium.make_vec(ID, num_envs=3, **SETTINGS), hierroom.load("b")),
        play_with_agent,
    ),
}


@pytest.mark.parametrize("kind", KINDS | DIRECT)
def test_kept_results_never_change(kind):
    make, play = (KINDS | DIRECT)[kind]
    env = make()
    begin(env)
    kept = [(results, plain(results)) for results in play(env, actions(40))]
    assert [plain(results) for results, _ in kept] == [then for _, then in kept]


@pytest.mark.parametrize("entries", [WORLDS["rooms"], {"task": "chest_task:chest"}])
def test_kept_state_of_a_trainer_never_changes(entries):
    tiny = {"num_envs": 4, "minibatches": 2, "sequence_length": 8, "hidden_size": 8, "max_steps": 20}
    trainer, kept = Trainer(TrainConfig().changed(**tiny, **entries)), []
    for _ in range(2):
        trainer.advance()
        state = {"whole": trainer.state_dict(), "weights": trainer.controller.weights}
        kept.append((state, copy.deepcopy(state)))
    assert all(equal(state, then) for state, then in kept)


def first_episode(**entries):
    config = EnvConfig(**entries, max_steps=20, reward=passing)
    return next(hierroom.rollout(Player(0, 5), config, 1, seed=1, observations=True))


def first_situation(**entries):
    return Turns(EnvConfig(**entries), 2, seed=0).situation(np.arange(2))


def facts_of(situation):
    view = situation.view
    return plain((situation.as_dict(), situation.level(0), situation.reachable, view.depth_first_ranks))


def play(agent):
    return next(hierroom.rollout(agent, episodes=1, num_envs=1)).to_dict()


def again(thing):
    return pickle.loads(pickle.dumps(thing))


MAZE = "#########\n#@ r R E#\n#########"
RULES = hierroom.Rules({"wood": {}, "table": {"uses": "wood", "gives": "table"}}, "table")
EVERY_WORLD = {**WORLDS, "layout": {"layout": MAZE}, "task of lambdas": {"task": chest_task.lake}}
DOES = {
    **{
        f"situation in {world}": (lambda entries=entries: first_situation(**entries), facts_of)
        for world, entries in EVERY_WORLD.items()
    },
    "report": (lambda: hierroom.complexity.analyze("c"), lambda report: report.to_dict()),
    "report of rules": (lambda: hierroom.complexity.analyze(RULES), lambda report: report.to_dict()),
    "task": (lambda: chest_task.chest, lambda task: first_episode(task=task).to_dict()),
    "agent": (lambda: hierroom.load("a"), play),
}


@pytest.mark.parametrize("world", EVERY_WORLD)
def test_pickled_episode_knows_everything_and_replays_in_worlds_without_user_functions(world):
    episode = first_episode(**EVERY_WORLD[world])
    loaded = again(episode)
    assert of_episode(loaded) == of_episode(episode)
    assert (loaded.subgoals, loaded.events, repr(loaded)) == (episode.subgoals, episode.events, repr(episode))
    if "task" in world:
        with pytest.raises(InputError, match=r"^an episode of .+ that was pickled has no environment to replay it in$"):
            list(loaded.states())
        episode = copy.deepcopy(episode)
    else:
        assert plain([*loaded.states()]) == plain([*episode.states()])
    assert len([*episode.states()]) == len(episode) + 1


@pytest.mark.parametrize("thing", DOES)
def test_pickled_things_do_the_same(thing):
    make, do = DOES[thing]
    made = make()
    do(made)  # some keep what they have computed
    assert repr(do(again(made))) == repr(do(made))
