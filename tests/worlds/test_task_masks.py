"""Tasks whose environments say which actions are legal, and raise an error for the others."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorWrapper
from pettingzoo.test import api_test

import hierroom
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.turns.turns import Turns

SMALL = ["--num-envs", "4", "--sequence-length", "16", "--minibatches", "2", "--epochs", "1", "--hidden-size", "8"]
SMALL += ["--steps", "256", "--evaluations", "1", "--evaluation-episodes", "4", "--threads", "1", "--log", "none"]


class Gates(gymnasium.Env):
    """In place p, of 12, only the actions p and p + 1 (modulo 4) are legal; action p + 1 leads on to the next place."""

    action_space = spaces.Discrete(4)

    def __init__(self, where="info", mask=None):
        self.where, self.mask, parts = where, mask, {"place": spaces.Discrete(12)}
        if where == "observation":
            parts["action_mask"] = spaces.MultiBinary(4)
        self.observation_space = spaces.Dict(parts)

    def action_masks(self):
        place = np.arange(4)
        legal = (place == self.place % 4) | (place == (self.place + 1) % 4)
        return legal if self.mask is None else self.mask

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = 0
        return self._shown()

    def step(self, action):
        if not self.action_masks()[action] and self.mask is None:
            raise ValueError(f"action {action} is forbidden in place {self.place}")
        self.place += int(action == (self.place + 1) % 4)
        observation, info = self._shown()
        return observation, float(self.place == 11), self.place == 11, False, info

    def _shown(self):
        observation, info, mask = {"place": self.place}, {}, self.action_masks()
        if self.place == 11:
            mask = np.zeros(4, bool)  # nothing is legal after the end
        if self.where in ("observation", "info"):
            {"observation": observation, "info": info}[self.where]["action_mask"] = mask.astype(np.int8)
        if self.where == "list":
            info["action_mask"] = mask.tolist()
        return observation, info


def task_of(where, **entries):
    return hierroom.Task(lambda: Gates(where), {"end": lambda env, info: env.place == 11}, max_steps=40, **entries)


gates = {where: task_of(where) for where in ("info", "observation", "method")}
info, spread = gates["info"], task_of("info", processes=2)


@pytest.mark.parametrize("task", [*gates.values(), spread], ids=[*gates, "processes"])
def test_mask_is_found_and_shown_in_every_api(task):
    assert {*task.features} == {"place", "goal-status"}
    env, agents = hierroom.env(task), np.random.default_rng(0)
    for seed in range(2):
        env.reset(seed=seed)
        for agent in env.agent_iter():
            observation, _, terminated, truncated, _ = env.last()
            if agent == "controller_0" and not (terminated or truncated):
                place = int(observation["place"])
                assert sorted(np.flatnonzero(observation["action_mask"])) == sorted({place % 4, (place + 1) % 4})
            choices = np.flatnonzero(observation["action_mask"])
            env.step(None if terminated or truncated else int(agents.choice(choices)))
    vector = gymnasium.make_vec("hierroom/Task-v0", num_envs=3, task=task, meta="fixed-dfs")
    observations, _ = vector.reset(seed=0)
    for _ in range(60):  # also through the ends of episodes
        assert (observations["action_mask"].sum(axis=1) == 2).all()
        observations, *_ = vector.step(observations["action_mask"].argmax(axis=1))
    vector.close()
    flat = gymnasium.make("hierroom/Task-v0", task=task, meta="fixed-dfs")
    flat.reset(seed=0)
    assert flat.unwrapped.action_masks().tolist() == [True, True, False, False]


def test_forbidden_action_costs_the_step_and_the_checkers_pass():
    env = hierroom.parallel_env(info)
    env.reset(seed=0)
    _, _, _, _, infos = env.step({"meta_0": 0, "controller_0": 3})  # the environment would raise an error
    assert infos["controller_0"]["illegal_actions"] == 1
    api_test(hierroom.env(info), num_cycles=50)


@pytest.mark.parametrize("memory", ["none", "lstm"])
def test_training_takes_legal_actions_only(memory, tmp_path):
    out = tmp_path / "run"
    assert train(["--task", "test_task_masks:info", *SMALL, "--memory", memory, "--out", str(out)]) == 0
    agent = hierroom.load(out, trust=True)
    played = hierroom.rollout(agent, None, 4, num_envs=2, observations=True)
    for episode in played:
        masks = episode.observations["action_mask"][:-1]
        assert masks[np.arange(len(episode)), episode.actions].all()
        assert (masks.sum(axis=1) == 2).all()
        assert len([*episode.states()]) == len(episode) + 1
    env = hierroom.add_features(gymnasium.make("hierroom/Task-v0", task=info, meta="fixed-dfs"), agent)
    observation, state = env.reset(seed=1)[0], None
    for _ in range(10):
        action, state = agent.act(observation, state)
        assert observation["action_mask"][action]
        observation, *_ = env.step(action)
    assert RunFolder.open(out).evaluations.read()


@pytest.mark.parametrize(
    ("make", "entries", "said"),
    [
        (lambda: Gates("info", np.zeros(4, bool)), {}, "task forbids every action: its mask is all False"),
        (lambda: Gates("info", np.ones(3, bool)), {}, "action_mask of task must be 4 flags, one an action"),
        (lambda: Gates("info"), {"action_mask": "legal"}, "task has no mask 'legal', in its info"),
        (lambda: gymnasium.make("Pendulum-v1"), {"action_mask": "legal"}, "a mask is for Discrete actions"),
    ],
)
def test_wrong_mask_is_refused_in_one_line(make, entries, said):
    task = hierroom.Task(make, **entries)
    with pytest.raises(InputError) as refused:
        task.make_world(hierroom.EnvConfig(task=task), 1, seed=0)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


class Endless(Gates):
    """Does not end by itself."""

    def step(self, action):
        return *super().step(action)[:2], False, False, self._shown()[1]


def test_mask_may_forbid_everything_where_the_target_ends_the_episode():
    task = hierroom.Task(lambda: Endless(), {"end": lambda env, info: env.place == 11}, target="end")
    assert all(one.success for one in hierroom.rollout("random", hierroom.EnvConfig(task=task), 8, num_envs=2))


@pytest.mark.parametrize("mode", [*AutoresetMode])
@pytest.mark.parametrize("where", [*gates, "list"])
@pytest.mark.parametrize("kind", [SyncVectorEnv, AsyncVectorEnv])
def test_vector_has_the_masks_and_episodes_of_single_environments(kind, where, mode):
    def make_vec(num_envs):
        return VectorWrapper(kind([lambda: Gates(where)] * num_envs, autoreset_mode=mode))

    def episodes(task):
        found = hierroom.rollout("random", hierroom.EnvConfig(task=task), 6, num_envs=3, seed=1)
        return [(one.actions.tolist(), one.terminated) for one in found]

    assert episodes(hierroom.Task(make_vec=make_vec)) == episodes(hierroom.Task(lambda: Gates(where)))


class LateMask(gymnasium.Wrapper):
    """Taxi with a mask after steps only."""

    def __init__(self):
        super().__init__(gymnasium.make("Taxi-v4"))

    def reset(self, **options):
        return super().reset(**options)[0], {}


@pytest.mark.parametrize("entries", [{"make": LateMask}, {"make_vec": lambda n: SyncVectorEnv([LateMask] * n)}])
def test_mask_of_steps_alone_is_refused(entries):
    with pytest.raises(InputError, match=r"^the info of task has 'action_mask' after a step but not after a reset"):
        hierroom.Task(**entries).trial.n_actions  # noqa: B018


def test_forbidden_action_of_a_vector_raises_input_error():
    task = hierroom.Task(make_vec=lambda num_envs: SyncVectorEnv([Gates] * num_envs))
    with pytest.raises(InputError, match=r"actions of task, a vector, must all be in Discrete\(4\) and legal$"):
        Turns(hierroom.EnvConfig(task=task), 2, seed=0).step([0, 2])


def test_mask_is_left_out_on_request():
    task = hierroom.Task(lambda: Gates("observation", np.ones(4, bool)), action_mask="")
    assert task.trial.mask is None
    assert "observation_action_mask" in task.features
