"""Pictures, text, windows and animations. test_world_minigrid.py compares the pictures with MiniGrid's."""

import re

import numpy as np
import pictures
import pytest

from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS
from hierroom.support.errors import InputError
from hierroom.support.pictures import gif
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.render import OUTLINE, LevelReplayer, draw_level, text
from hierroom.worlds.window import StateScreen, Window


@pytest.fixture
def world():
    return Engine([NAMED_GRAPHS["c"]], seed=1)


def screen(world, render_mode):
    return StateScreen(world.get_state, LevelReplayer(), render_mode)


def where(state, tile):
    ((row, col),) = np.argwhere(state.grids[0] == tile) - constants.MARGIN
    return row, col


def test_the_subgoal_is_outlined_and_named(world):
    plain, colour = draw_level(world.state), int(world.state.levels[0].colours[0])
    for goal, tile in (
        (colour, constants.KEY + colour),
        (6 + colour, constants.LOCKED_DOOR + colour),
        (EXIT_GOAL, constants.EXIT),
    ):
        frame = draw_level(world.state, goal)
        assert frame.shape == plain.shape == (19 * 32, 19 * 32, 3)
        row, col = where(world.state, tile)
        assert (frame[row * 32, col * 32 : (col + 1) * 32] == OUTLINE).all()
        # The rest of the picture is the same, except for the lowest wall, which shows the caption.
        expected = plain.copy()
        expected[row * 32 : (row + 1) * 32, col * 32 : (col + 1) * 32] = frame[
            row * 32 : (row + 1) * 32, col * 32 : (col + 1) * 32
        ]
        np.testing.assert_array_equal(frame[:-32], expected[:-32])
        assert (frame[-32:] != plain[-32:]).any()
    captions = {draw_level(world.state, goal)[-32:].tobytes() for goal in range(13)}
    assert len(captions) == 13


def test_drawing_does_not_change_the_state(world):
    before = world.get_state()
    before.levels["seen"] = 0
    kept = before.copy()
    draw_level(before, 3)
    text(before, 3)
    assert before.levels["seen"] == kept.levels["seen"]
    assert (before.grids == kept.grids).all()


def test_text_shows_objects_agent_and_goals(world):
    level = world.state.levels[0]
    path = shortest_actions(world.state, int(level.colours[0]))
    for action in path:
        world.step_within_episode([action])
    shown = text(world.state, 6 + int(level.colours[0]))
    assert f"\x1b[1;91m{('>>', 'vv', '<<', '^^')[level.direction]}\x1b[0m" in shown
    lines = re.sub(r"\x1b\[[0-9;]*m", "", shown).split("\n")
    assert [len(line) for line in lines[:19]] == [38] * 19
    names = [("red", "green", "blue", "purple", "yellow", "grey")[colour] for colour in level.colours]
    initials = ["rgbpyw"[colour] for colour in level.colours]
    for tile, letters in (
        (constants.EXIT, "EX"),
        (constants.KEY + level.colours[1], "k" + initials[1]),
        (constants.LOCKED_DOOR + level.colours[0], "D" + initials[0]),
    ):
        row, col = where(world.state, tile)
        assert lines[row][2 * col : 2 * col + 2] == letters
    agent = lines[level.row - constants.MARGIN][2 * (level.col - constants.MARGIN) :][:2]
    assert agent == (">>", "vv", "<<", "^^")[level.direction]
    assert lines[19:] == [
        f"keys and doors: {', '.join(f'{name} {room}' for room, name in enumerate(names[:2], start=1))}; "
        f"the exit is in room {level.exit_room}",
        f"step {len(path)} of 1000, keys held: {names[0]} key 1",
        f"subgoal: {names[0]} door 1",
    ]
    assert text(world.state).count("\n") == 20


def test_animation_contains_every_frame(world, tmp_path):
    frames = [draw_level(world.state, tile_size=8)]
    for action in shortest_actions(world.state):
        world.step_within_episode([action])
        frames.append(draw_level(world.state, tile_size=8))
    path = tmp_path / "escape.gif"
    path.write_bytes(gif(iter(frames)))
    again = pictures.frames(path)
    assert len(again) == len(frames)
    for one, frame in zip(again, frames, strict=True):
        assert one.shape == frame.shape == (19 * 8, 19 * 8, 3)
        assert abs(one - frame).max() < 10  # 256 colours


def test_window_shows_frames_and_closes(world, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame

    window = Window("a level", frames_per_second=1000)
    window.close()  # nothing is open yet
    for tile_size in (16, 8):
        frame = draw_level(world.state, tile_size=tile_size)
        window.show(frame)
        screen = pygame.display.get_surface()
        assert screen.get_size() == (frame.shape[1], frame.shape[0])
        np.testing.assert_array_equal(pygame.surfarray.array3d(screen).swapaxes(0, 1), frame)
    assert pygame.display.get_caption()[0] == "a level"
    window.close()
    assert not pygame.display.get_init()


def test_window_without_display_raises_input_error(world, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(InputError, match=r"cannot open a window \(.*\): it needs a screen; render_mode 'rgb_array'"):
        Window().show(draw_level(world.state))


def test_screen_renders_in_each_mode(world, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    assert screen(world, "ansi").render(0, 3) == text(world.state, 3)
    np.testing.assert_array_equal(screen(world, "rgb_array").render(0, 3), draw_level(world.state, 3))
    assert screen(world, None).render(0, -1) is None
    window = screen(world, "human")
    window.show(0, 3)
    assert window.render(0, 3) is None
    window.close()
    with pytest.raises(InputError, match="render_mode must be one of ansi, rgb_array, human or None, not 'rgb'"):
        screen(world, "rgb")


def test_invalid_input_raises_input_error(world):
    for show in (draw_level, text):
        with pytest.raises(InputError, match="shows one environment, but the state holds 2"):
            show(Engine([NAMED_GRAPHS["a"]], 2).state)
        with pytest.raises(InputError, match="whole number from 0 to 12, or -1 for none, not 13"):
            show(world.state, 13)
    with pytest.raises(InputError, match="tile_size must be a whole number of at least 1, not 0"):
        draw_level(world.state, tile_size=0)
