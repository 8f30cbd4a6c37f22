"""The Gymnasium vector environment; `test_api_equal` compares other parts of it with Gymnasium's own."""

import gymnasium
import numpy as np
import pytest
from api_scripts import same
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as wrappers

from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.escape_room.oracle import shortest_actions

SMALL = {"graph": "a", "size": 11, "max_steps": 9}


def test_reset_takes_a_seed_for_each_environment():
    """An episode depends only on the seed and index of its environment; without a seed, the next episode begins."""
    lists, sevens, nines = EscapeRooms(3, **SMALL), EscapeRooms(3, **SMALL), EscapeRooms(3, **SMALL)
    of_list, of_7, of_9 = (env.reset(seed=seed)[0] for env, seed in ((lists, [7, 9, 7]), (sevens, 7), (nines, 9)))
    for name, values in of_list.items():
        for n, expected in enumerate((of_7, of_9, of_7)):
            np.testing.assert_array_equal(values[n], expected[name][n])
    again, of_next = lists.reset(seed=np.array([7, 9, 7]))[0], nines.reset()[0]
    same(again, of_list)
    mixed = lists.reset(seed=[7, None, 7])[0]
    np.testing.assert_array_equal(mixed["observation"][1], of_next["observation"][1])
    np.testing.assert_array_equal(mixed["observation"][0], of_list["observation"][0])


def test_reset_without_seed_draws_a_seed():
    firsts = {EscapeRooms(1, **SMALL).reset(seed=[None])[0]["observation"].tobytes() for _ in range(8)}
    assert len(firsts) > 4


def test_copy_false_reuses_arrays_with_equal_values():
    fresh, kept = EscapeRooms(4, **SMALL), EscapeRooms(4, copy=False, **SMALL)
    rng = np.random.default_rng(0)
    (observations, _), (views, _) = fresh.reset(seed=1), kept.reset(seed=1)
    for _ in range(30):
        actions = rng.integers(5, size=4)
        before = views
        observations, views = fresh.step(actions)[0], kept.step(actions)[0]
        same(observations, views)
        assert all(views[name] is before[name] for name in views)
        assert fresh.observation_space.contains(observations)


def test_final_infos_report_success_and_length():
    env, ends = EscapeRooms(4, graph="a", size=11, max_steps=60, autoreset_mode="SameStep"), []
    env.reset(seed=1)
    for _ in range(120):
        actions = [int(shortest_actions(env.turns.world.get_state(n))[0]) if n < 2 else 1 for n in range(4)]
        _, _, terminated, truncated, infos = env.step(actions)
        ended = terminated | truncated
        if ended.any():
            observed = infos["final_info"]
            np.testing.assert_array_equal(observed["success"], terminated)
            np.testing.assert_array_equal(observed["_success"], ended)
            np.testing.assert_array_equal(observed["length"] > 0, ended)
            ends += [*terminated[ended]]
    assert 0 < sum(ends) < len(ends)


def test_autoreset_mode_is_validated_and_in_the_metadata():
    for mode in AutoresetMode:
        for given in (mode, mode.value):
            env = EscapeRooms(2, autoreset_mode=given, **SMALL)
            assert env.metadata["autoreset_mode"] is env.autoreset_mode is mode
    usual = EscapeRooms(2, **SMALL)
    assert EscapeRooms.metadata["autoreset_mode"] is usual.autoreset_mode is AutoresetMode.NEXT_STEP
    with pytest.raises(InputError, match=r"^autoreset_mode must be one of NextStep, SameStep, Disabled, not 'never'$"):
        EscapeRooms(2, autoreset_mode="never")
    made = gymnasium.make_vec("hierroom/EscapeRoom-a-v0", 2)
    assert made.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


@pytest.mark.parametrize(
    "wrap", [wrappers.NormalizeObservation, wrappers.NormalizeReward, wrappers.RecordEpisodeStatistics]
)
def test_gymnasium_vector_wrappers_take_the_environments(wrap):
    envs = wrap(wrappers.FlattenObservation(gymnasium.make_vec("hierroom/EscapeRoom-a-v0", 4, size=11, max_steps=9)))
    observations, _ = envs.reset(seed=0)
    ended = 0
    for _ in range(25):
        observations, rewards, terminated, truncated, _ = envs.step(envs.action_space.sample())
        ended += (terminated | truncated).sum()
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
    assert ended >= 8


def test_without_autoreset_ended_environments_must_be_reset():
    env = EscapeRooms(3, autoreset_mode="Disabled", **SMALL)
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.ones(3, int))
    env.reset(options={"reset_mask": np.array([True, False, False])})
    for _ in range(5):
        *_, truncated, infos = env.step(np.ones(3, int))
    assert (truncated.tolist(), infos["length"].tolist()) == ([False, True, True], [5, 9, 9])
    with pytest.raises(InputError, match=r"^the episodes of environments 1, 2 have ended: reset them first"):
        env.step(np.ones(3, int))
    _, infos = env.reset(options={"reset_mask": truncated})
    assert infos["_length"].tolist() == truncated.tolist()
    env.step(np.ones(3, int))


def test_refused_reset_changes_nothing():
    envs = [EscapeRooms(2, autoreset_mode="Disabled", meta="fixed-dfs", **SMALL) for _ in range(2)]
    observed = []
    for n, env in enumerate(envs):
        env.reset(seed=0)
        for _ in range(9):
            env.step(np.ones(2, int))
        if n:
            with pytest.raises(InputError, match="seed"):
                env.reset(seed=-1)
        observed.append(env.reset(options={"reset_mask": np.array([True, False])}))
    same(observed[0][0], observed[1][0])
    assert observed[0][0]["goal"][1].any()


def test_next_step_mode_ignores_the_action_at_reset():
    env = EscapeRooms(2, autoreset_mode="NextStep", **SMALL)
    env.reset(seed=0)
    for _ in range(9):
        *_, truncated, _ = env.step([1, 1])
    assert truncated.all()
    _, rewards, terminated, truncated, infos = env.step([77, 0])
    assert not any(values.any() for values in (rewards, terminated, truncated, infos["illegal_actions"]))
    assert (infos["length"].tolist(), infos["elapsed"].tolist()) == ([0, 0], [0, 0])
    assert (infos["shortest_length"] > 0).all()


@pytest.mark.parametrize(
    ("mask", "given"),
    [
        ([True, False], r"\[True, False\]"),
        (np.array([1, 0]), r"int64 and shape \(2,\)"),
        (np.zeros(2, bool), r"bool and shape \(2,\)"),
        (np.ones(3, bool), r"bool and shape \(3,\)"),
    ],
)
def test_invalid_reset_mask_raises_input_error(mask, given):
    env = EscapeRooms(2, autoreset_mode="Disabled", **SMALL)
    env.reset(seed=0)
    with pytest.raises(InputError, match=rf"^reset_mask must be 2 bool, at least one of them True, not {given}$"):
        env.reset(options={"reset_mask": mask})
    with pytest.raises(InputError, match=r"^reset all environments before only some of them$"):
        EscapeRooms(2).reset(options={"reset_mask": np.array([True, False])})


def test_all_environments_are_rendered():
    env = EscapeRooms(2, render_mode="rgb_array", **SMALL)
    with pytest.raises(InputError, match="reset the environment before it is rendered"):
        env.render()
    env.reset(seed=0)
    one, other = env.render()
    assert one.shape == other.shape
    assert not np.array_equal(one, other)
    text = EscapeRooms(2, render_mode="ansi", **SMALL)
    text.reset(seed=0)
    assert [type(level) for level in text.render()] == [str, str]
    assert EscapeRooms(2).render() is None
    with pytest.raises(InputError, match="render_mode of many environments must be one of ansi, rgb_array or None"):
        EscapeRooms(2, render_mode="human")
