"""The log of the last episodes, counted by hand: window, milestones, and going back to a saved state."""

from types import SimpleNamespace

import numpy as np

from hierroom.training.episode_log import MILESTONES, WINDOW, EpisodeLog


def ended(*successes, length=10):
    """A step that ended one episode in each of these environments, and none in one more."""
    flags = np.array([*successes, False])
    return SimpleNamespace(
        episode_ended=np.array([*[True] * len(successes), False]), terminated=flags, lengths=np.full(len(flags), length)
    )


def test_milestones_are_first_crossings_of_a_full_window():
    log = EpisodeLog()
    for n in range(WINDOW - 1):
        log.add(ended(True), steps=n, seconds=n / 10)
    assert log.success_rate == 1
    assert log.steps_to == {}, "the window is not full yet"
    log.add(ended(False), steps=1000, seconds=100.0)
    assert log.episodes == WINDOW
    assert log.success_rate == (WINDOW - 1) / WINDOW
    assert log.steps_to == dict.fromkeys(MILESTONES, 1000)
    for n in range(300):
        log.add(ended(False, length=30), steps=2000 + n, seconds=200.0)
    assert log.success_rate == 199 / WINDOW
    assert log.episode_length == (200 * 10 + 300 * 30 - 0) / WINDOW
    assert log.steps_to == dict.fromkeys(MILESTONES, 1000), "only the first crossing counts"
    assert log.seconds_to == dict.fromkeys(MILESTONES, 100.0)


def test_each_milestone_is_crossed_in_its_own_time():
    log = EpisodeLog()
    for n in range(WINDOW):
        log.add(ended(False), steps=n, seconds=0.0)
    for n in range(WINDOW):
        log.add(ended(True), steps=WINDOW + n, seconds=0.0)
    assert log.steps_to == {percent: WINDOW + percent * WINDOW // 100 - 1 for percent in MILESTONES}


def test_a_step_that_ends_no_episode_changes_nothing_and_a_state_comes_back():
    log, other = EpisodeLog(), EpisodeLog()
    log.add(ended(True, False, True), steps=5, seconds=1.0)
    before = log.state_dict()
    log.add(ended(), steps=6, seconds=2.0)
    assert log.state_dict() == before
    assert log.success_rate == 2 / 3
    other.load_state_dict(before)
    assert other.state_dict() == before
    other.add(ended(True), steps=7, seconds=3.0)
    assert log.state_dict() == before, "the state is a copy"
