"""Playing oneself: the game by its rules, and the window by posted keys, on no screen."""

import os
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pygame
import pytest

import hierroom
from hierroom.commands.play import PlayArguments, main, make_game
from hierroom.lab.play.app import App
from hierroom.lab.play.board import FOG, RGB, level_picture, tile_size, window_size
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import FORWARD, KEY, LEFT, MARGIN, OPEN, PICKUP, RIGHT
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.render import seen_cells

KEY_OF = {
    FORWARD: pygame.K_UP,
    LEFT: pygame.K_LEFT,
    RIGHT: pygame.K_RIGHT,
    PICKUP: pygame.K_SPACE,
    OPEN: pygame.K_SPACE,
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run that has learned little."""
    out = tmp_path_factory.mktemp("played") / "run"
    small = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 8, "minibatches": 2, "steps": 256}
    hierroom.train(**small, meta="fixed-dfs", evaluations=0, out=out)
    return out


def new_game(**arguments):
    return make_game(PlayArguments(**arguments))


def plan_of(game):
    return shortest_actions(game.state).tolist()


@pytest.mark.parametrize("graph", ["a", "d", "f"])
def test_the_oracles_way_reaches_each_goal_and_the_exit(graph):
    game = new_game(graph=(graph,), seed=3)
    plan, said = plan_of(game), []
    assert len(plan) == game.shortest
    for action in plan:
        assert (
            game.hint == f"{['forward', 'left', 'right', 'pick up', 'open'][action]} ({len(plan_of(game))} to the exit)"
        )
        game.step(action)
        said.append(game.message)
    assert game.has_escaped
    assert said[-1] == f"escaped in {len(plan)} steps"
    assert [name for name in said if name.endswith("!")] == [f"{game.name_of(goal)}!" for goal in game.achieved[:-1]]
    assert game.achieved[-1] == 12
    assert game.hint == "none, the level has ended"
    before = game.state
    game.step(FORWARD)  # nothing more happens
    np.testing.assert_array_equal(game.state.levels, before.levels)
    assert game.message.startswith("the level has ended")


def test_levels_begin_again_and_anew():
    game = new_game(graph=("c",), seed=1)
    first = game.state
    for _ in range(2):
        for action in plan_of(game)[:9]:
            game.step(action)
        game.restart()
        np.testing.assert_array_equal(game.state.levels, first.levels)
        np.testing.assert_array_equal(game.state.grids, first.grids)
        assert (game.achieved, game.message, game.has_ended) == ([], "", False)
        game.next_level()
        second = game.state
        assert second.levels["episode"] == first.levels["episode"] + 1
        first = second
    assert new_game(graph=("c",), seed=1).state.grids.tolist() != game.state.grids.tolist()


def test_the_limit_of_steps():
    game = new_game(max_steps=4)
    for _ in range(4):
        game.step(LEFT)
    assert game.has_ended
    assert not game.has_escaped
    assert game.message == "the limit of 4 steps is reached"


def test_space_picks_up_and_opens_and_says_why_not():
    game = new_game(graph=("a",), seed=0)
    messages = set()
    for n_steps, action in enumerate(plan_of(game)):
        level = game.state.levels[0]
        if action in (PICKUP, OPEN):
            game.use()
        else:
            if not int(level.keys):
                game.use()  # no key yet: whatever is in front, nothing happens
                messages.add(game.message)
                assert int(game.state.levels[0].steps) == n_steps
            game.step(action)
        assert int(game.state.levels[0].steps) == n_steps + 1
    assert game.has_escaped
    assert messages == {"there is neither a key nor a locked door in front"}
    game.restart()
    stand_before_door(game)
    game.use()
    assert game.message == f"this door needs {game.name_of(int(game.state.levels[0].colours[0]))}"
    assert int(game.state.levels[0].steps) == 0


def stand_before_door(game):
    state = game.turns.get_state()
    level = state["levels"][0]
    top, left, bottom, right = level.rectangles[0]
    row, col = level.doors_at[0]
    level.row, level.col = np.clip(row, top, bottom), np.clip(col, left, right)
    facing = {(0, 1): 0, (1, 0): 1, (0, -1): 2, (-1, 0): 3}
    level.direction = facing[row - level.row, col - level.col]
    game.turns.set_state(state)


def test_what_was_seen_grows_and_fog_hides_the_rest():
    game = new_game(graph=("f",), seed=2)
    game.has_fog = True
    side, size = tile_size(13), 13
    for action in plan_of(game):
        before = game.seen.copy()
        game.step(action)
        np.testing.assert_array_equal(game.seen, before | seen_cells(game.state))
        picture = level_picture(game).reshape(size, side, size, side, 3).swapaxes(1, 2)
        is_hidden = (picture == FOG).all(axis=(2, 3, 4))
        np.testing.assert_array_equal(is_hidden, ~game.seen)
    game.has_fog = False
    assert not (level_picture(game).reshape(size, side, size, side, 3).swapaxes(1, 2) == FOG).all(axis=(2, 3, 4)).any()


@pytest.mark.parametrize("taken_over_after", [0, 1, 7, 60])
def test_an_agent_that_takes_over_remembers_what_it_looked_on_to(run, taken_over_after):
    agent = hierroom.load(run)
    episode = next(hierroom.rollout(agent, None, 1, seed=4))
    game = new_game(agent=run, seed=4)
    for number, action in enumerate(episode.actions.tolist()):
        assert game.goal == episode.goals[number]
        game.step(action if number < taken_over_after else None)
        assert game.has_ended == (number + 1 == len(episode))
    assert game.has_escaped == episode.success
    assert game.achieved == [event.goal for event in episode.events]
    *_, last = episode.states()
    np.testing.assert_array_equal(game.state.grids, last.grids)


def test_an_agent_elsewhere(run):
    game = new_game(agent=run, graph=("c",), size=15, max_steps=20)
    assert (game.graph.name, game.state.size, int(game.state.levels[0].max_steps)) == ("c", 15, 20)
    game.step()
    assert int(game.state.levels[0].steps) == 1


@pytest.fixture
def app(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    apps = []

    def opened(**arguments):
        apps.append(App(make_game(PlayArguments(**arguments))))
        return apps[-1]

    yield opened
    pygame.display.quit()


def press(app, *keys, milliseconds=10):
    for key in keys:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))
        app.frame(milliseconds)


def shown(app):
    return pygame.surfarray.array3d(app.surface).swapaxes(0, 1)


def test_a_level_played_by_keys(app):
    opened = app(graph=("d",), seed=5)
    game, pictures = opened.game, [shown(opened)]
    assert pictures[0].shape[:2] == window_size(13)[::-1]
    for action in plan_of(game):
        press(opened, KEY_OF[action])
        pictures.append(shown(opened))
    assert game.has_escaped
    assert all((one != other).any() for one, other in pairwise(pictures))
    press(opened, pygame.K_n)
    assert not game.has_ended
    press(opened, pygame.K_w, pygame.K_a, pygame.K_d)
    assert int(game.state.levels[0].steps) == 3
    press(opened, pygame.K_r)
    assert int(game.state.levels[0].steps) == 0
    press(opened, pygame.K_q)
    assert not opened.is_open


def test_the_goal_graph_lights_up(app):
    opened = app(graph=("c",), seed=5)
    game, panel = opened.game, slice(tile_size(13) * 13, None)
    colours = [RGB[colour] for colour in game.state.levels[0].colours[:2].tolist()]

    def lit():
        return [int((shown(opened)[:, panel] == colour).all(axis=2).sum()) for colour in colours]

    steps = [lit()]
    for action in plan_of(game):
        n_achieved = len(game.achieved)
        press(opened, KEY_OF[action])
        if len(game.achieved) > n_achieved and not game.has_ended:
            steps.append(lit())
    assert len(steps) == 5
    (key1, door1, key2, door2) = [np.subtract(after, before) for before, after in pairwise(steps)]
    assert key1[0] > 100 < key2[1]
    assert door1[0] > 100 < door2[1]
    assert key1[1] == door1[1] == key2[0] == door2[0] == 0


def test_hint_fog_and_what_is_not_there(app):
    opened = app(graph=("f",), seed=2)
    plain = shown(opened)
    press(opened, pygame.K_o)
    assert opened.game.has_hints
    hinted = shown(opened)
    assert (hinted != plain).any()
    press(opened, pygame.K_o, pygame.K_f)
    foggy = shown(opened)
    assert (foggy == FOG).all(axis=2).mean() > 0.2 > (plain == FOG).all(axis=2).mean()
    press(opened, pygame.K_f)
    np.testing.assert_array_equal(shown(opened)[:, : tile_size(13) * 13], plain[:, : tile_size(13) * 13])
    press(opened, pygame.K_t)
    assert not opened.game.is_piloted
    assert opened.game.message == "begin with --agent RUN to let a trained agent take over"
    press(opened, pygame.K_x)
    assert opened.game.message == "keys cannot be dropped here; begin with --drop-key"
    assert int(opened.game.state.levels[0].steps) == 0


def test_keys_are_dropped(app):
    opened = app(graph=("a",), drop_key=True)
    game = opened.game
    for action in plan_of(game):
        press(opened, KEY_OF[action])
        if int(game.state.levels[0].keys):
            break
    for _ in range(4):  # somewhere around the agent there is room for it
        press(opened, pygame.K_LEFT, pygame.K_x)
    assert int(game.state.levels[0].keys) == 0
    assert (game.state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN] == KEY + game.state.levels[0].colours[0]).sum() == 1


def test_an_agent_takes_over_and_hands_back(app, run):
    opened = app(agent=run, seed=4)
    game = opened.game
    press(opened, pygame.K_t)
    assert game.is_piloted
    for _ in range(5):
        opened.frame(1000)
    steps = int(game.state.levels[0].steps)
    assert 4 <= steps <= 6
    opened.frame(1)  # it is not due yet
    assert int(game.state.levels[0].steps) == steps
    press(opened, pygame.K_LEFT)  # who moves has taken over
    assert not game.is_piloted
    opened.frame(1000)
    assert int(game.state.levels[0].steps) == steps + 1
    press(opened, pygame.K_t)
    for _ in range(100):
        opened.frame(1000)
    assert game.has_ended


def test_the_close_button(app):
    opened = app()
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    opened.run()
    assert not opened.is_open
    assert not pygame.display.get_init()


@pytest.mark.parametrize("entries", [{"graph": ("rooms:7",), "size": 63}, {"graph": ("a",), "size": 11}])
def test_large_and_small_levels_fit_a_screen(app, entries):
    opened = app(**entries)
    width, height = opened.surface.get_size()
    assert width <= 1100
    assert height <= 700
    press(opened, pygame.K_o, pygame.K_f)


def test_the_command(run, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    opened = []

    def note(self):
        opened.append(self.game)
        pygame.display.quit()

    monkeypatch.setattr(App, "run", note)
    assert main(["--graph", "f", "--fog", "--seed", "7"]) == 0
    (game,) = opened
    assert (game.graph.name, game.has_fog, game.agent) == ("f", True, None)
    assert main(["--agent", str(run)]) == 0
    assert opened[1].agent is not None


def test_an_agent_of_another_world_is_refused(monkeypatch):
    agent = SimpleNamespace(config=SimpleNamespace(env=EnvConfig(task="workshop:2")))
    monkeypatch.setattr("hierroom.runs.trained_agent.load", lambda *_, **__: agent)
    with pytest.raises(InputError, match="play shows levels of EscapeRooms, and the agent of mine plays workshop:2"):
        new_game(agent=Path("mine"))


def test_what_cannot_be_used_is_one_line(run, monkeypatch, tmp_path, capfd):
    for argv, message in (
        (["--size", "5"], "size must be a whole number from 11 to 63, not 5"),
        (["--agent", str(tmp_path)], "is not a run folder"),
        (["--agent", str(run), "--drop-key"], "was trained without --drop-key"),
    ):
        with pytest.raises(InputError, match=message):
            main(argv)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    monkeypatch.setattr(pygame.display, "init", lambda: os.write(2, b"error: a line of SDL's own"))
    with pytest.raises(InputError, match="play needs a screen, and there is none here"):
        main(["--graph", "a"])
    assert "SDL" not in capfd.readouterr().err
    monkeypatch.undo()
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(InputError, match=r"cannot open a window .*: play needs a screen"):
        main(["--graph", "a"])
