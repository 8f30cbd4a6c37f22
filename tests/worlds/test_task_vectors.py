"""Tasks of environments that come as a vector."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

import hierroom
from hierroom.worlds.make import make_world

MODES = [*AutoresetMode]
SHOWN = gymnasium.spaces.Box(0, 3, (1,), np.float32)


class Walk(gymnasium.Env):
    """Ends three steps forward; its info says how many have been taken."""

    observation_space, action_space = SHOWN, gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        self.at = 0
        return np.zeros(1, np.float32), {"at": 0}

    def step(self, action):
        self.at += int(action)
        return np.array([self.at], np.float32), float(self.at), self.at == 3, False, {"at": self.at, "elapsed": 2}


class Walks(VectorEnv):
    """The same for N environments, each of which begins anew in the step after its end."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012
    single_observation_space, single_action_space = SHOWN, Walk.action_space

    def __init__(self, num_envs):
        self.num_envs = num_envs

    def reset(self, *, seed=None, options=None):
        self.at, self.ended = np.zeros((2, self.num_envs), int)
        return self.at[:, None].astype(np.float32), {"at": self.at}

    def step(self, actions):
        self.at = np.where(self.ended, 0, self.at + actions)
        self.ended = self.at == 3
        results = self.at * 1.0, self.ended, np.zeros(self.num_envs, bool), {"at": self.at}
        return self.at[:, None].astype(np.float32), *results


GOALS = {"steps": lambda env, info: info["at"], "there": lambda env, info: info["at"] == 3}
SEEN = {"steps": GOALS["steps"], "there": lambda env, infos: infos["observation"][:, 0] == 3}


def walks(mode, **entries):
    def make_vec(num_envs):
        return SyncVectorEnv([Walk] * num_envs, autoreset_mode=mode)

    return hierroom.Task(make_vec=make_vec, **{"goals": SEEN, "target": "there", "label": "walks", **entries})


def played(task, **entries):
    config = hierroom.EnvConfig(task=task, **entries)
    found = [*hierroom.rollout("random", config, episodes=60, num_envs=8, seed=3)]
    return [(e.actions.tolist(), e.events, e.extrinsic.tolist(), e.terminated, e.success) for e in found], found


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("entries", [{}, {"max_steps": 5}])
def test_vector_of_each_mode_has_the_episodes_of_single_environments(mode, entries):
    single, _ = played(hierroom.Task(Walk, GOALS, target="there", label="walks"), **entries)
    assert played(walks(mode), **entries)[0] == single


def test_early_target_resets_its_environment_alone():
    for mode in MODES:
        halfway = {"half": lambda env, infos: infos["at"] == 2}
        _, episodes = played(walks(mode, goals=halfway, target="half"))
        assert all(one.success and one.actions.sum() == 2 and one.extrinsic[-1] == 2 for one in episodes)
    with pytest.raises(hierroom.InputError, match="of walks resets no single environments, and a reset, the target"):
        played(hierroom.Task(make_vec=Walks, goals=halfway, target="half", label="walks"))


def test_vector_that_begins_anew_by_itself_takes_a_step_for_it():
    _, episodes = played(hierroom.Task(make_vec=Walks, goals=SEEN, target="there"))
    for one in episodes:
        is_later = one.number > 0
        assert (one.success, one.actions[is_later:].sum()) == (True, 3)
        assert one.events[0].step > is_later
    assert len({one.number for one in episodes}) > 1


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("make_vec", [walks, lambda mode: hierroom.Task(make_vec=Walks, goals=SEEN, target="there")])
def test_vector_environment_over_a_vector_takes_every_mode(mode, make_vec):
    rooms = gymnasium.make_vec(
        "hierroom/Task-v0", num_envs=3, task=make_vec(AutoresetMode.SAME_STEP), autoreset_mode=mode
    )
    rooms.reset(seed=0)
    n_ended, terminated = 0, np.zeros(3, bool)
    for t in range(60):
        is_reset = terminated & (mode is AutoresetMode.NEXT_STEP)
        observations, rewards, terminated, *_ = rooms.step(np.array([1, t % 2, 1]))
        assert (rewards[terminated] == 3).all()
        assert not observations["observation"][is_reset].any()
        n_ended += terminated.sum()
        if mode is AutoresetMode.DISABLED and terminated.any():
            observations, _ = rooms.reset(options={"reset_mask": terminated})
            assert observations["observation"].shape == (3, 1)
    assert n_ended >= 30


@pytest.mark.parametrize("mode", MODES)
def test_elapsed_counts_in_the_step_that_ends_an_episode(mode):
    world = make_world(hierroom.EnvConfig(task=walks(mode)), 2, seed=0)
    assert [world.step(np.array([1, 0]))["elapsed"].tolist() for _ in range(4)] == [[2, 2]] * 4


@pytest.mark.parametrize("ends", [{}, {"final_info": np.array([{"at": 3}] * 2)}])
def test_infos_of_ended_episodes_must_be_there(ends):
    class Unlike(SyncVectorEnv):
        def step(self, actions):
            *results, infos = super().step(actions)
            return *results, {"at": infos["at"], "final_obs": infos["final_obs"], **ends} if results[2].any() else infos

    def make_vec(num_envs):
        return Unlike([Walk] * num_envs, autoreset_mode=AutoresetMode.SAME_STEP)

    with pytest.raises(hierroom.InputError, match="must give the infos of ended episodes as a dict final_info, not"):
        played(hierroom.Task(make_vec=make_vec, goals=SEEN, target="there"))


def test_restored_vector_begins_new_episodes_and_says_so():
    world = make_world(hierroom.EnvConfig(task=walks(AutoresetMode.NEXT_STEP)), 4, seed=0)
    world.step(np.ones(4, int))
    saved = world.get_arrays(world.everywhere)
    world.set_arrays(saved)
    assert "begin anew" in world.notes[-1]
    assert world.observe(world.everywhere).entries["observation"].sum() == 0
    assert world.step(np.ones(4, int))["truncated"].all()


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"make": Walk, "make_vec": Walks}, "exactly one of make"),
        ({}, "exactly one of make"),
        ({"make_vec": Walks, "processes": 2}, "processes of a task are for make"),
        ({"make_vec": 3}, "is a function of num_envs, not 3"),
        ({"make_vec": lambda num_envs: Walk()}, "must return a VectorEnv of 2 environments"),
        (
            {"make_vec": Walks, "goals": {"x": lambda env, infos: True}},
            "for each environment of the vector, not True",
        ),
        ({"make_vec": Walks, "goals": {"x": lambda env, infos: infos["at"] - 1}}, "counts of at least 0"),
        ({"make": Walk, "goals": {"x": lambda env, info: np.ones(2, bool)}}, "must return True, False or a count"),
    ],
)
def test_wrong_vector_or_goal_raises_input_error(entries, said):
    with pytest.raises(hierroom.InputError, match=said):
        hierroom.Task(**{"target": "x" if "goals" in entries else None, **entries}).trial.n_actions  # noqa: B018


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (0, np.zeros((2, 2), np.float32), "outside its observation space: an array of float32 and shape (2, 2)"),
        (0, np.full((2, 1), np.nan), "a network reads finite numbers"),
        (1, [1.0, np.inf], "must return finite numbers as rewards, not inf"),
        (1, 1.0, "must return 2 finite numbers as rewards, not an array of float64 and shape ()"),
        (2, np.zeros(2, int), "must return 2 True or False as terminated, not an array of int64"),
    ],
)
def test_wrong_result_of_a_vector_raises_input_error(place, value, said):
    class Wrong(Walks):
        def step(self, actions):
            return *(results := super().step(actions))[:place], value, *results[place + 1 :]

    with pytest.raises(hierroom.InputError) as refused:
        hierroom.Task(make_vec=Wrong).trial.n_actions  # noqa: B018
    assert said in str(refused.value)


def test_target_true_at_a_reset_is_warned_of():
    here = {"here": lambda env, infos: infos["at"] == 0}
    with pytest.warns(UserWarning, match="the target 'here' of here is true at a reset"):
        walks(AutoresetMode.NEXT_STEP, goals=here, target="here", label="here").trial  # noqa: B018
