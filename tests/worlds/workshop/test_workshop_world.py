"""Workshops as a world: seeds, states, features, goals, pictures, and every API."""

import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test
from pictures import has_colour
from same_state import equal
from workshop_twin import CRAFT

import hierroom
from hierroom import EnvConfig, InputError
from hierroom.agents.config import METHODS
from hierroom.agents.features import Features
from hierroom.agents.playback import pictures
from hierroom.complexity.draw import DONE, PURSUED, rules_picture
from hierroom.learners.config import PPOConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.thread_pool import MIN_ENVS_PER_THREAD
from hierroom.turns.records import META
from hierroom.turns.turns import Turns
from hierroom.worlds.make import find_task, world_spec
from hierroom.worlds.workshop import world as module
from hierroom.worlds.workshop.layout import BENCH, PLACES, SHELF, SHOP

TASK = hierroom.workshop(CRAFT)
ACTIONS = np.random.default_rng(0).integers(0, TASK.n_actions, (150, 6))


def make(n=6, seed=0, **entries):
    return TASK.make_world(EnvConfig(task=TASK, max_steps=40, **entries), n, seed=seed)


def test_environment_is_the_same_alone_and_in_a_batch():
    together, alone = make(), make(1, env_index=4)
    for row in ACTIONS:
        assert together.step(row)[4] == alone.step(row[4:5])[0]
        np.testing.assert_array_equal(together.state.things[4], alone.state.things[0])


def test_two_threads_equal_one_thread(monkeypatch):
    n, used, step = 2 * MIN_ENVS_PER_THREAD + 1, [], module._STEP.run

    def noted_step(*arrays):
        used.append((threading.get_ident(), len(arrays[0])))
        step(*arrays)

    monkeypatch.setattr(module._STEP, "run", noted_step)
    config = EnvConfig(task=TASK, max_steps=40)
    one, two = (TASK.make_world(config, n, seed=3, threads=threads) for threads in (1, 2))
    for actions in np.random.default_rng(1).integers(0, TASK.n_actions, (60, n)):
        assert (one.step(actions) == two.step(actions)).all()
    for name, array in vars(one.get_state()).items():
        np.testing.assert_array_equal(array, getattr(two.get_state(), name))
    assert {size for thread, size in used if thread != threading.get_ident()} == {n // 2, n // 2 + 1}


def test_training_and_evaluation_share_no_shelf_order():
    orders = {}
    for levels in ("training", "evaluation"):
        world, orders[levels] = make(64, levels=levels), set()
        for _ in range(30):
            orders[levels] |= {order.tobytes() for order in world.state.things[:, PLACES]}
            world.reset()
        assert len(orders[levels]) > 1000
    assert not orders["training"] & orders["evaluation"]


def test_set_arrays_continues_the_episodes():
    world, other = make(), make(seed=9)
    for row in ACTIONS[:75]:
        world.step(row)
    arrays = world.get_arrays(world.everywhere)
    other.set_arrays(arrays)
    for row in ACTIONS[75:]:
        assert world.step(row).tolist() == other.step(row).tolist()
    assert other.get_state().things.tolist() == world.get_state().things.tolist()


def test_state_after_is_from_before_the_reset():
    world, n_ended = make(), 0
    for row in ACTIONS:
        before = world.get_state()
        outcomes = world.step(row).copy()
        after = world.state_after(before, row)
        ended = outcomes["terminated"] | outcomes["truncated"]
        n_ended += ended.sum()
        assert (after.shops["steps"] == outcomes["length"]).all()
        assert (after.shops["has_ended"] == ended).all()
        assert after[~ended].things.tolist() == world.get_state(~ended).things.tolist()
        last = world.last_view(world.everywhere, ended)
        assert last.things.tolist() == after.things.tolist()
    assert n_ended > 12


@pytest.mark.parametrize(
    ("part", "place", "value", "said"),
    [
        ("things", (1, BENCH, 0), 9, "of no thing are there more than its limit, but not in environment 1"),
        ("things", (0, PLACES, 0), 99, "each thing that a recipe asks for has one place"),
        ("things", (0, SHELF, TASK.book.things.index("crown")), 1, "an episode has ended with the target or"),
        ("things", (0, BENCH, TASK.book.things.index("dust")), 1, "the bench holds only what has a place"),
        ("things", (2, PLACES, -1), 1, "there are no other places"),
        ("shops", ("steps", 0), 40, "an episode has ended with the target or after its last step"),
        ("shops", ("achieved", 3), 2**40, r"workshops\.achieved must be at most 127"),
        ("shops", ("max_steps", 3), 0, r"workshops\.max_steps must be at least 1"),
    ],
)
def test_invalid_state_raises_input_error(part, place, value, said):
    world = make()
    arrays = world.get_arrays(world.everywhere)
    world.set_arrays(arrays)
    if part == "shops":
        name, place = place
        arrays["shops"][name][place] = value
    else:
        arrays[part][place] = value
    with pytest.raises(InputError, match=said):
        world.set_arrays(arrays)
    with pytest.raises(InputError, match="must be an array"):
        world.set_arrays(arrays | {"shops": np.zeros(5, SHOP)})


def test_features_stay_below_their_cardinalities():
    for task in (TASK, find_task("workshop:40")):
        config = EnvConfig(task=task, goal_mask="existing")
        turns, n_goals, n_places = Turns(config, 6, seed=0), len(task.goal_set), task.n_actions - 2
        features = Features(world_spec(config), (*task.features, "symbol"))
        pairs, seen = Features(world_spec(config), ("goal-shelf",)), {}
        for t in range(40):
            turns.choose(turns.situation(turns.due(META)), np.full(len(turns.due(META)), t % (n_goals + 1)))
            observation = turns.observe("controller_0", np.arange(6))
            assert (features.encode(observation) < features.cardinalities).all()
            places, goals = turns.world.state.things[:, PLACES, :n_places], turns.goals
            numbers = pairs.encode(observation).reshape(6, -1, n_places)
            assert ((numbers > 0).sum(axis=1) == 1).all()
            for env in range(6):
                for place in range(n_places):
                    key = place, numbers[env, :, place].tobytes()
                    assert seen.setdefault(key, (goals[env], places[env, place])) == (goals[env], places[env, place])
            turns.step(np.zeros(6, int))
            turns.reset()
        assert len(seen) == len({(place, *pair) for (place, _), pair in seen.items()})


def test_goal_masks_and_levels_follow_the_recipes():
    world = make(1)
    turn = np.ones(1, bool)
    for mask, legal in (
        ("reachable", {"log", "stick"}),
        ("existing", {*CRAFT.names}),
        ("seen", {"log", "stick", None}),
        ("none", {*CRAFT.names}),
    ):
        row = world.legal_goals(mask, turn)[0]
        assert {name for name, is_legal in zip((*CRAFT.names, None), row, strict=True) if is_legal} == legal
    assert world.legal_goals("reachable", ~turn).tolist() == [[False] * 7 + [True]]
    view = world.exact_view(world.everywhere)
    level = view.level(0, view.reachable[0])
    assert (level.facts["wood"], level.goals[0].name, level.legal_goals[-1].name) == (1, "log", "stick")
    assert str(level) == "step 0; achieved: nothing; legal goals: log, stick"
    with pytest.raises(InputError, match="goal_mask of a workshop is one of"):
        world.legal_goals("far", turn)


@pytest.mark.parametrize("meta", ["fixed-dfs", "oracle", "random"])
def test_recipe_controller_succeeds_with_every_meta_controller(meta):
    env = gymnasium.make("hierroom/Workshop-v0", task=TASK, meta=meta, max_steps=600)
    for seed in range(5):
        env.reset(seed=seed)
        single, ended = env.unwrapped.single, False
        while not ended:
            goal, world = single.goal, single.turns.world
            way = next(way for way in np.flatnonzero(TASK.book.recipes.goals == goal) if is_there(world, way))
            _, _, terminated, truncated, info = env.step(next_action(world, way))
            ended = terminated or truncated
        assert info["success"]
        if meta == "oracle":
            assert info["length"] == info["shortest_length"]


def is_there(world, way):
    return (world.state.things[0, 1:].sum(axis=0) >= TASK.book.recipes.asks[way]).all()


def next_action(world, way):
    places, bench = world.state.things[0, PLACES].tolist(), world.state.things[0, BENCH]
    missing = np.flatnonzero(TASK.book.recipes.asks[way] > bench)
    return places.index(missing[0]) if len(missing) else world.n_actions - 2


def test_replayer_draws_workshops_and_names_actions():
    world = make(1)
    state, replayer, n_places = world.get_state(), world.replayer, world.n_actions - 2
    place = state.things[0, PLACES].tolist().index(0)
    names = [replayer.action_name(state, action) for action in (place, n_places, n_places + 1, n_places + 2)]
    assert names == ["put wood", "work", "clear", "illegal action"]
    text = replayer.text(state, 3)
    assert f"{place} wood x1" in text
    assert text.endswith("subgoal: stick = wood")
    plain, marked = replayer.picture(state, -1, 40), replayer.picture(state, 3, 40)
    assert plain.shape == marked.shape
    assert (plain != marked).any()
    states = list(replayer.replay(state, np.array([place, n_places, n_places + 1])))
    assert [one.things[0, SHELF, 0] for one in states] == [1, 0, 0, 0]
    with pytest.raises(InputError, match="a picture shows one environment, but the state holds 6"):
        replayer.text(make().get_state())


def test_workshops_pass_the_api_checkers():
    api_test(hierroom.env(task="workshop:4", max_steps=30), num_cycles=60)
    parallel_api_test(hierroom.parallel_env(TASK, max_steps=30), num_cycles=60)
    check_env(gymnasium.make("hierroom/Workshop-v0").unwrapped, skip_render_check=True)


@pytest.mark.parametrize("method", [*sorted({*METHODS} - {"ppo-novelty"}), "learned", "random"])
def test_every_method_trains_and_resumes_from_its_state(method, one_thread):
    agents = {"meta": method} if method not in METHODS else {"method": method}
    meta_ppo = PPOConfig(sequence_length=2, minibatches=2, sequences_per_update=4)
    settings = {"num_envs": 4, "sequence_length": 8, "meta_start_success": 0.0, "max_steps": 30, "threads": 1}
    config = hierroom.find_preset("default").changed(task="workshop:3", meta_ppo=meta_ppo, **settings, **agents)
    first, second = Trainer(config), Trainer(config)
    for _ in range(4):
        first.advance()
    second.load_state_dict(first.state_dict())
    for _ in range(2):
        assert first.advance() == second.advance()
    states = [trainer.state_dict() for trainer in (first, second)]
    assert equal(*({name: state[name] for name in ("turns", "agents", "log")} for state in states))


def test_film_shows_rules_achieved_goals_and_marking():
    (episode,) = hierroom.rollout("oracle", EnvConfig(task="workshop:4"), 1, seed=0)
    frames, states = [*pictures(episode)], [*episode.states()]
    level = episode.replayer.picture(states[0], -1, episode.replayer.tile_size(states[0]))
    assert len({frame.shape for frame in frames}) == 1
    graphs = [frame[:, level.shape[1] :] for frame in frames]
    n_achieved = [int(episode.replayer.rules_state(state)[0].sum()) for state in states]
    assert (n_achieved[0], n_achieved[-1]) == (0, 4)
    assert [has_colour(graph, DONE).any() for graph in graphs] == [n > 0 for n in n_achieved]
    rules, drawn = episode.graph, set()
    for marking, achieved, goal in ((0, (), None), (0, ("water",), None), (1, ("water",), None), (0, (), "water")):
        counts = [marking if fact == "water" else there for fact, there in rules.start.items()]
        one = rules_picture(rules, frozenset(achieved), tuple(counts), goal)
        assert has_colour(one, PURSUED).any() == (goal is not None)
        drawn.add(one.tobytes())
    assert len(drawn) == 4
