"""The window of `play`, driven by posted keys without a screen."""

from itertools import pairwise

import numpy as np
import pygame
import pytest

from hierroom.commands.play import PlayArguments, make_game
from hierroom.lab.play import FRAMES_PER_STEP, App
from hierroom.worlds.escape_room.constants import FORWARD, LEFT, OPEN, PICKUP, RIGHT
from hierroom.worlds.escape_room.oracle import shortest_actions

KEY_OF = {
    FORWARD: pygame.K_UP,
    LEFT: pygame.K_LEFT,
    RIGHT: pygame.K_RIGHT,
    PICKUP: pygame.K_SPACE,
    OPEN: pygame.K_SPACE,
}


def plan_of(game):
    return shortest_actions(game.state).tolist()


@pytest.fixture
def app(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    apps = []

    def opened(**arguments):
        apps.append(App(make_game(PlayArguments(**arguments))))
        apps[-1].window.frames_per_second = 0  # do not wait
        return apps[-1]

    yield opened
    pygame.display.quit()


def press(app, *keys):
    for key in keys:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))
        app.frame()


def wait(app, frames=FRAMES_PER_STEP):
    for _ in range(frames):
        app.frame()


def shown(app):
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


def test_keys_play_a_level_to_the_exit(app):
    opened = app(graph=("a",), seed=5)
    game, pictures = opened.game, [shown(opened)]
    np.testing.assert_array_equal(pictures[0], opened.picture)
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


def test_keys_toggle_hint_or_explain(app):
    opened = app(graph=("f",), seed=2)
    plain = shown(opened)
    press(opened, pygame.K_o)
    assert opened.game.has_hints
    assert (shown(opened) != plain).any()
    press(opened, pygame.K_t)
    assert not opened.game.is_piloted
    assert opened.game.message == "begin with --agent RUN to let a trained agent take over"
    press(opened, pygame.K_x)
    assert opened.game.message == "keys cannot be dropped here; begin with --drop-key"
    assert int(opened.game.state.levels[0].steps) == 0


def test_an_agent_takes_over_and_hands_back(app, played):
    opened = app(agent=played, seed=4)
    game = opened.game
    press(opened, pygame.K_t)
    assert game.is_piloted
    wait(opened, 5 * FRAMES_PER_STEP)
    steps = int(game.state.levels[0].steps)
    assert 4 <= steps <= 6
    opened.frame()  # it is not due yet
    assert int(game.state.levels[0].steps) == steps
    press(opened, pygame.K_LEFT)  # a move of the user takes over
    assert not game.is_piloted
    wait(opened)
    assert int(game.state.levels[0].steps) == steps + 1
    press(opened, pygame.K_t)
    for _ in range(100):
        if not game.has_ended:
            wait(opened)
    assert game.has_ended


def test_close_button_closes_the_window(app):
    opened = app()
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    opened.run()
    assert not opened.is_open
    assert not pygame.display.get_init()


@pytest.mark.parametrize("entries", [{"graph": ("rooms:7",), "size": 63}, {"graph": ("a",), "size": 11}])
def test_large_and_small_levels_fit_a_screen(app, entries):
    opened = app(**entries)
    width, height = pygame.display.get_surface().get_size()
    assert width <= 1100
    assert height <= 700
    press(opened, pygame.K_o)
