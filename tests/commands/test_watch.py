"""Watching a trained agent: in a window, as text, in files, and failures alone."""

import json

import numpy as np
import pictures
import pytest

import hierroom
from hierroom.agents.playback import pictures as drawn
from hierroom.commands import watch
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.render import draw_level, legible_tile_size
from hierroom.worlds.window import Window


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run that has learned little: it escapes from some levels of 60 steps and fails in others."""
    config = TrainConfig().changed(graph="a", size=11, max_steps=60, num_envs=8, minibatches=2, steps=256)
    folder, trainer = RunFolder.create(tmp_path_factory.mktemp("watched") / "run", config), Trainer(config)
    trainer.advance()
    folder.save_checkpoint(trainer.state_dict())
    return folder.path


@pytest.fixture
def watched(run, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)

    def watched(*options):
        assert watch.main([str(run), *map(str, options)]) == 0
        return capsys.readouterr().out

    return watched


def episode_of(player="random", **entries):
    return next(hierroom.rollout(player, EnvConfig(**{"graph": "a", "size": 11, "max_steps": 60, **entries}), 1))


def test_watch_prints_level_subgoals_and_outcomes(watched, run):
    said = watched("--episodes", 2)
    assert "\x1b" not in said  # the output is no terminal
    for episode in hierroom.rollout(hierroom.load(run), None, 2):
        assert episode.title in said
        for subgoal in episode.subgoals:
            row = [str(subgoal.first_step), str(subgoal.steps), *subgoal.name.split(), *subgoal.outcome.split()]
            assert any(line.split()[: len(row)] == row for line in said.splitlines())


def test_failures_option_shows_only_failures(watched, run, tmp_path):
    said = watched("--failures", "--episodes", 3, "--most", 50, "--out", tmp_path / "f.json")
    shown = json.loads((tmp_path / "f.json").read_text())
    assert [episode["success"] for episode in shown] == [False] * 3
    played = list(hierroom.rollout(hierroom.load(run), None, 50))
    failures = [n for n, episode in enumerate(played) if not episode.success]
    assert shown == [json.loads(json.dumps(played[n].to_dict())) for n in failures[:3]]
    assert said.startswith(f"3 failures in the first {failures[2] + 1} episodes\n")


def test_failures_option_without_failures_writes_nothing(watched, tmp_path, monkeypatch):
    from hierroom.runs import rollout

    escape = episode_of("oracle")

    def escapes(agent, env, episodes, **_):
        return iter([escape] * episodes)

    monkeypatch.setattr(rollout, "rollout", escapes)
    said = watched("--failures", "--most", 200, "--out", tmp_path / "f.gif")
    assert said == "no failure in 200 episodes: 95% interval of success 98.1% to 100.0%; nothing to show\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", ["gif", "txt", "json"])
def test_watch_writes_gif_txt_and_json(kind, watched, tmp_path):
    out = tmp_path / f"watched.{kind}"
    said = watched("--out", out, "--graph", "c", "--size", 13, "--greedy", "--meta", "oracle", "--seed", 3)
    assert said.splitlines()[-1] == str(out)
    assert said.startswith("graph c, seed 3, environment 0, episode 0: ")
    if kind == "gif":
        assert pictures.frames(out)[0].shape == (13 * 24, 13 * 24, 3)
    elif kind == "txt":
        assert "keys and doors: " in out.read_text()
        assert "\x1b" not in out.read_text()
    else:
        assert json.loads(out.read_text())[0]["graph"] == "c"


def test_invalid_watch_arguments_raise_input_error(run, tmp_path):
    for out, message in (
        (tmp_path / "a.avi", r"episodes are written as .gif, .txt, .json, not as a.avi"),
        (tmp_path / "no" / "a.gif", r"cannot write .*a.gif: there is no folder .*no"),
    ):
        with pytest.raises(InputError, match=message):
            watch.main([str(run), "--out", str(out)])
    for name in ("episodes", "most"):
        with pytest.raises(InputError, match=f"{name} must be at least 1, not 0"):
            watch.main([str(run), f"--{name}", "0"])
    with pytest.raises(InputError, match="--most goes with --failures, which is missing"):
        watch.main([str(run), "--most", "5"])
    with pytest.raises(InputError, match="--text prints the episodes, and --out writes them"):
        watch.main([str(run), "--text", "--out", str(tmp_path / "a.gif")])
    with pytest.raises(InputError, match=r"is not a run folder: it has no config.json"):
        watch.main([str(tmp_path)])
    with pytest.raises(InputError, match=f"is not a run folder, but contains some, such as {run}"):
        watch.main([str(run.parent)])


def test_pictures_name_step_action_and_subgoal(run):
    episode = next(hierroom.rollout(hierroom.load(run), None, 1))
    tile_size, shown = legible_tile_size(11), list(drawn(episode))
    assert len(shown) == len(episode) + 1
    for step, state in enumerate(episode.states()):
        goal = int(episode.goals[min(step, len(episode) - 1)])
        end = "" if step < len(episode) else ", escaped" if episode.success else ", did not escape"
        title = f"step {step} of 60" + (f": {episode.action_name(step)}" if step else "") + end
        np.testing.assert_array_equal(shown[step], draw_level(state, goal, tile_size, title))


def test_pictures_of_long_episode_name_the_omitted_steps():
    episode = episode_of(max_steps=57)
    assert len(episode) == 57
    whole, cut = list(drawn(episode)), list(drawn(episode, most=20))
    np.testing.assert_array_equal(cut[:11], whole[:11])
    np.testing.assert_array_equal(cut[-11:], whole[-11:])
    cards = cut[11:-11]
    assert len(cards) == 10
    *states, _ = episode.states()
    expected = draw_level(states[47], -1, legible_tile_size(11), "steps 11 to 46 are left out")
    assert all((card == expected).all() for card in cards)
    assert [len(list(drawn(episode, most=most))) for most in (54, 56, 58)] == [56 + 10, 58, 58]


def test_watch_shows_episodes_in_a_window(run, monkeypatch, capsys):
    shown, titles = [], []

    class Screen(Window):
        def show(self, frame):
            shown.append(frame)
            titles.append(self.title)
            self.frames_per_second = 1e6
            super().show(frame)

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("hierroom.worlds.window.Window", Screen)
    assert watch.main([str(run), "--episodes", "2"]) == 0
    episodes = list(hierroom.rollout(hierroom.load(run), None, 2))
    assert len(shown) == sum(len(episode) + 1 + 9 for episode in episodes)
    assert list(dict.fromkeys(titles)) == [episode.title for episode in episodes]
    assert capsys.readouterr().out.splitlines() == [episode.title for episode in episodes]
    import pygame

    assert not pygame.display.get_init()  # it is closed


def test_watch_prints_text_if_no_window_opens(run, monkeypatch, capsys):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    assert watch.main([str(run)]) == 0
    said = capsys.readouterr()
    assert "cannot open a window" in said.err
    assert "keys and doors: " in said.out


def test_keys_of_the_window_control_playback(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame

    frames = [np.full((20, 20, 3), n, np.uint8) for n in range(5)]

    def play(*keys_at):
        shown, window = [], Window(frames_per_second=1e6)
        show = window.show

        def noted(frame):
            shown.append(int(frame[0, 0, 0]))
            show(frame)
            for time, key in keys_at:
                if time == len(shown):
                    kind = pygame.QUIT if key == "close" else pygame.KEYDOWN
                    pygame.event.post(pygame.event.Event(kind, **({} if key == "close" else {"key": key})))

        monkeypatch.setattr(window, "show", noted)
        end = window.play(frames)
        window.close()
        return shown, end, window.frames_per_second

    assert play()[:2] == ([0, 1, 2, 3, 4], "ended")
    assert play((2, pygame.K_q))[:2] == ([0, 1], "closed")
    assert play((2, pygame.K_ESCAPE))[:2] == ([0, 1], "closed")
    assert play((3, "close"))[:2] == ([0, 1, 2], "closed")
    assert play((1, pygame.K_n))[:2] == ([0], "skipped")
    assert play((2, pygame.K_SPACE), (5, pygame.K_SPACE))[:2] == ([0, 1, 1, 1, 1, 2, 3, 4], "ended")
    paused_and_one_step = play((1, pygame.K_SPACE), (3, pygame.K_RIGHT), (5, pygame.K_q))
    assert paused_and_one_step[:2] == ([0, 0, 0, 1, 1], "closed")
    assert play((1, pygame.K_UP))[2] == 100
    assert play((1, pygame.K_DOWN))[2] == 100  # never faster than that
