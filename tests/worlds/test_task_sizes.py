"""Entries of observations: too large ones, grids of symbols among images of bytes, and actions of several steps."""

import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np
import pytest
import torch
from chest_task import Chest
from gymnasium import spaces

import hierroom
from hierroom import EnvConfig
from hierroom.learners.networks.input_layer import InputLayout
from hierroom.learners.rollout import Rollout
from hierroom.runs.config.presets import find_preset
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.worlds.task.spaces import feature_of, read_entry


class Sized(Chest):
    """A chest that shows one number of a space."""

    def __init__(self, space):
        super().__init__()
        self.observation_space, self.shown = space, space.sample()

    def _observation(self):
        return self.shown


def task_of(space):
    return hierroom.Task(lambda: Sized(space), {"chest": lambda env, info: env.unwrapped.is_open}, target="chest")


@pytest.mark.parametrize(
    ("space", "said"),
    [
        (spaces.Box(0, 255, (3000, 3000), np.uint8), "a network reads up to 4,194,304 numbers of an entry"),
        (spaces.Discrete(10**10), "a network reads discrete numbers of up to 2**31 values; number has 10,000"),
    ],
)
def test_large_observation_raises_input_error(space, said):
    with pytest.raises(InputError) as refused:
        feature_of("number", space)
    assert str(refused.value).startswith(said)


def test_many_turns_raise_input_error():
    said = "2,000 sequences of 1,000 turns with 600 bytes of features each need 1,276 MB, and at most 1,074 MB are "
    with pytest.raises(InputError, match=f"^{said}allowed: lower num_envs, sequence_length or sequences_per_update"):
        Rollout(1000, 1000, 2000, n_features=600, n_actions=3, state_size=128)


@pytest.mark.parametrize(
    "space", [spaces.Discrete(255, start=1, dtype=np.uint8), spaces.MultiDiscrete([255], np.uint8)]
)
def test_bytes_up_to_the_largest_are_inside(space):
    shown = [np.full(space.shape, number, np.uint8) for number in (int(np.min(space.start)), 254)]
    assert read_entry(shown, "number", (), space, "a task").ravel().tolist() == [int(one.max()) for one in shown]


def test_environments_of_a_large_discrete_number_play():
    task = task_of(spaces.Discrete(10**10))
    env = hierroom.env(task)
    env.reset(seed=0)
    assert env.observe("controller_0")["observation"] < 10**10


def test_many_goals_raise_input_error():
    with pytest.raises(InputError, match="a world has at most 63 goals, not 100000"):
        hierroom.Task(Chest, {str(n): lambda env, info: False for n in range(10**5)}, target="0")


class Waits(gymnasium.Env):
    """Each action takes as many steps as its number, and two more."""

    observation_space, action_space = spaces.Discrete(5), spaces.Discrete(3)
    reported = staticmethod(lambda action: {"elapsed": action + 2})

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.t = 0
        return 0, {}

    def step(self, action):
        self.t += 1
        return self.t, 1.0, self.t == 4, False, self.reported(int(action))


class Confused(Waits):
    reported = staticmethod(lambda action: {"elapsed": 0.5})


def is_late(env, info):
    return env.unwrapped.t >= 3


def turns_of(make):
    task = hierroom.Task(make=make, goals={"late": is_late}, target="late")
    turns = Turns(EnvConfig(task=task), 2, seed=0)
    turns.reset()
    turns.choose(turns.situation(np.arange(2)), np.array([0, 0]))
    return turns


def step(turns, *actions):
    turns.act("controller_0", turns.observe("controller_0", np.arange(2)), np.array(actions))
    return turns.step()


def test_options_last_as_long_as_their_actions():
    turns = turns_of(Waits)
    taken = [step(turns, 0, action) for action in (1, 2)]
    assert [one.elapsed.tolist() for one in taken] == [[2, 3], [2, 4]]
    assert taken[1].meta_elapsed.tolist() == [4, 7]
    assert taken[1].lengths.tolist() == [2, 2]  # of decisions: the limits of episodes count them


def test_learner_discounts_by_the_duration():
    taken = step(turns_of(Waits), 0, 1)
    assert taken.ended_turns("controller_0")[2].tolist() == [2, 3]


def test_duration_that_is_no_number_of_steps_is_refused():
    with pytest.raises(InputError, match=r"info\['elapsed'\] of task, .* a whole number from 1 to 1,000,000, not 0.5"):
        step(turns_of(Confused), 0, 0)


class Shows(gymnasium.Env):
    """Shows images [H, W] or [H, W, C] of the numbers below ``end``, which begin with 0."""

    action_space = spaces.Discrete(2)

    def __init__(self, shape, end):
        self.end, self.observation_space = end, spaces.Box(0, 255, shape, np.uint8)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(self.observation_space.shape, np.uint8), {}

    def step(self, action):
        return (
            self.np_random.integers(self.end, size=self.observation_space.shape, dtype=np.uint8),
            0.0,
            False,
            False,
            {},
        )


def showing(make, **arguments):
    return hierroom.Task(make, {"end": lambda env, info: False}, target="end", **arguments)


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda: Shows((28, 28), 255), "pixels"),
        (lambda: Shows((7, 7, 3), 33), "pixels"),
        (lambda: Shows((7, 7, 3), 32), "symbols"),
        (lambda: Shows((32, 32), 9), "pixels"),
        (lambda: gymnasium.make("MiniGrid-DoorKey-5x5-v0"), "symbols"),
    ],
)
def test_a_trial_says_what_symbols_are(make, kind):
    task = showing(make)
    (image,) = [feature.array for feature in task.features.values() if feature.array is not None]
    assert image.kind == kind


def test_the_user_says_what_symbols_are():
    kinds = {}
    for symbols in (("observation",), ()):
        features = showing(lambda: Shows((28, 28), 255), symbols=symbols).features
        kinds[symbols] = features["observation"].array.kind
    assert kinds == {("observation",): "symbols", (): "pixels"}
    task = showing(lambda: Shows((28, 28), 255), symbols=["image"])
    with pytest.raises(InputError, match=r"^symbols of task are entries .*, not 'image'; these are observation$"):
        task.trial  # noqa: B018
    with pytest.raises(InputError, match=r"^symbols of a task are a list of names of entries, not 'image'$"):
        showing(lambda: Shows((28, 28), 255), symbols="image")


def test_networks_of_earlier_versions_read_small_images_as_they_did():
    network = Trainer(
        find_preset("default").changed(task=showing(lambda: Shows((8, 8), 255)))
    ).controller.learner.network
    assert network.encoder.arrays[0].symbols is not None
    config = find_preset("task").changed(task=showing(lambda: Shows((8, 8), 255)))
    assert InputLayout.of(Trainer(config).controller.learner.space).pictures


def test_symbols_beyond_those_of_the_trial_count_as_the_last():
    task = showing(lambda: Shows((4, 4), 9))
    layer = Trainer(find_preset("task").changed(task=task)).controller.learner.network.encoder
    assert layer.layout.cardinalities[-16:] == (32,) * 16
    features = np.zeros((2, 18), np.uint8)  # the image, the goal and the previous action
    features[0, :16], features[1, :16] = 31, 200
    assert (layer.layout.read_codes(features)[:, -16:] == 31).all()
    first, second = layer(torch.from_numpy(features))
    assert torch.equal(first, second)
