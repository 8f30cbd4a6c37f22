"""Grids of symbols among images of bytes: a trial guesses, and the user can say it."""

import gymnasium
import minigrid  # noqa: F401 - it registers its environments
import numpy as np
import pytest
import torch
from gymnasium import spaces

import hierroom
from hierroom.learners.networks.input_layer import InputLayout
from hierroom.runs.config.presets import find_preset
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError


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


def task_of(make, **arguments):
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
    task = task_of(make)
    (image,) = [feature.array for feature in task.features.values() if feature.array is not None]
    assert image.kind == kind


def test_the_user_says_what_symbols_are():
    kinds = {}
    for symbols in (("observation",), ()):
        features = task_of(lambda: Shows((28, 28), 255), symbols=symbols).features
        kinds[symbols] = features["observation"].array.kind
    assert kinds == {("observation",): "symbols", (): "pixels"}
    task = task_of(lambda: Shows((28, 28), 255), symbols=["image"])
    with pytest.raises(InputError, match=r"^symbols of task are entries .*, not 'image'; these are observation$"):
        task.trial  # noqa: B018
    with pytest.raises(InputError, match=r"^symbols of a task are a list of names of entries, not 'image'$"):
        task_of(lambda: Shows((28, 28), 255), symbols="image")


def test_networks_of_earlier_versions_read_small_images_as_they_did():
    network = Trainer(
        find_preset("default").changed(task=task_of(lambda: Shows((8, 8), 255)))
    ).controller.learner.network
    assert network.encoder.arrays[0].symbols is not None
    config = find_preset("task").changed(task=task_of(lambda: Shows((8, 8), 255)))
    assert InputLayout.of(Trainer(config).controller.learner.space).pictures


def test_symbols_beyond_those_of_the_trial_count_as_the_last():
    task = task_of(lambda: Shows((4, 4), 9))
    layer = Trainer(find_preset("task").changed(task=task)).controller.learner.network.encoder
    assert layer.layout.cardinalities[-16:] == (32,) * 16
    features = np.zeros((2, 18), np.uint8)  # the image, the goal and the previous action
    features[0, :16], features[1, :16] = 31, 200
    assert (layer.layout.read_codes(features)[:, -16:] == 31).all()
    first, second = layer(torch.from_numpy(features))
    assert torch.equal(first, second)
