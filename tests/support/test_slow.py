"""Lines about slow work: what is done, the time left, and silence where it is wanted."""

import re
import time

import pytest

import hierroom
from hierroom.support import output
from hierroom.support.output import silence


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(output, "FIRST_SECONDS", 0.05)
    monkeypatch.setattr(output, "NEXT_SECONDS", 60.0)


def test_lines_have_the_share_and_the_time_left(capsys):
    for share in (0.25, 0.0):
        with output.said_when_slow("stirring 8 pots") as tell:
            tell(share)
            time.sleep(0.2)
    first, second = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"stirring 8 pots: 25% done, about \d+ seconds? left", first)
    assert re.fullmatch(r"stirring 8 pots: \d+ seconds?", second)
    words = {0.2: "1 second", 119: "119 seconds", 121: "2 minutes", 7300: "2 hours"}
    assert {seconds: output.duration(seconds) for seconds in words} == words


def test_quick_or_silenced_work_writes_nothing(capsys):
    for _ in output.said_in_turn("counting", range(3)):
        pass
    with silence(), output.said_when_slow("sleeping"):
        time.sleep(0.2)
    assert capsys.readouterr().err == ""


def test_rollout_writes_lines_unless_progress_is_given(monkeypatch, capsys):
    monkeypatch.setattr(output, "FIRST_SECONDS", 0.0)
    env, done = hierroom.EnvConfig("a", size=11, max_steps=20), []
    for progress in (None, done.append):
        for _ in hierroom.rollout("random", env, 4, progress=progress):
            time.sleep(0.02)
    assert len(re.findall(r"^playing 4 episodes: ", capsys.readouterr().err, re.MULTILINE)) == 1
    assert done[-1] == 4


def test_episodes_that_are_kept_waiting_write_no_more_lines(monkeypatch, capsys):
    monkeypatch.setattr(output, "NEXT_SECONDS", 0.05)
    episodes = hierroom.rollout("random", hierroom.EnvConfig("a", size=11, max_steps=20), 4, num_envs=1)
    next(episodes)
    next(episodes)  # only now is the first one counted
    time.sleep(0.5)
    episodes.close()
    assert capsys.readouterr().err.count("playing 4 episodes: 25% done") == 1
