"""The window of a game: the level, and a goal graph that lights up as goals are reached."""

from __future__ import annotations

import numpy as np
import pygame
from numpy.typing import NDArray

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, NO_GOAL
from hierroom.goals.drawing import tree_places
from hierroom.lab.play.game import Game
from hierroom.worlds.escape_room.constants import KEY, LOCKED_DOOR, MARGIN
from hierroom.worlds.escape_room.render import cells_of, draw_level
from hierroom.worlds.escape_room.rooms import rooms_of

PANEL, LEVEL = 390, 684  # pixels: the width of the panel, and the approximate width of the level
PAPER, INK, FAINT = (24, 28, 36), (232, 236, 243), (150, 160, 176)
ACCENT, GOOD, FOG = (109, 179, 245), (70, 200, 110), 34
RGB = ((240, 60, 50), (60, 215, 80), (80, 120, 255), (170, 90, 235), (245, 225, 60), (165, 165, 165))  # as `COLOURS`
KEYS = (
    ("arrows, wasd", "move: forward, turn left or right"),
    ("space", "pick up or open what is in front"),
    ("x", "drop a key (where --drop-key)"),
    ("o", "the oracle's next action"),
    ("t", "a trained agent takes over"),
    ("f", "fog: hide what was not seen yet"),
    ("n, r", "next level, this one again"),
    ("q", "quit"),
)


def tile_size(size: int) -> int:
    """Return the side of a cell in pixels."""
    return max(8, LEVEL // size)


def window_size(size: int) -> tuple[int, int]:
    """Return the width and height of the window."""
    return tile_size(size) * size + PANEL, max(tile_size(size) * size, 660)


def level_picture(game: Game) -> NDArray[np.uint8]:
    """Return a picture [H, W, 3] of the level, with the game's fog, and a frame around the agent's subgoal."""
    state = game.state
    side, size = tile_size(state.size), state.size
    picture = draw_level(state, NO_GOAL, side)
    cells = picture.reshape(size, side, size, side, 3)
    tiles = state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN]
    for row, col in cells_of(game.goal, tiles):
        frame = cells[row, :, col]
        for edge in (frame[:3], frame[-3:], frame[:, :3], frame[:, -3:]):
            edge[:] = 255
    if game.has_fog:
        cells.swapaxes(1, 2)[~game.seen] = FOG
    return picture


class Board:
    """Draws a game onto a surface of `window_size`."""

    def __init__(self, surface: pygame.Surface) -> None:
        self._surface = surface
        pygame.font.init()
        self._large, self._normal, self._small = (pygame.font.Font(None, size) for size in (34, 25, 21))

    def draw(self, game: Game) -> None:
        """Draw the level and the panel."""
        self._surface.fill(PAPER)
        picture = level_picture(game)
        level = pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        above = (self._surface.get_height() - level.get_height()) // 2
        self._surface.blit(level, (0, above))
        self._numbers(game, above)
        left = level.get_width() + 22
        top = self._facts(game, left)
        top = self._tree(game, left, top + 12)
        top = max(top + 14, self._surface.get_height() - 26 * len(KEYS) + 4)
        for number, (keys, purpose) in enumerate(KEYS):
            self._write(keys, (left, top + 25 * number), self._small, INK)
            self._write(purpose, (left + 104, top + 25 * number), self._small, FAINT)

    def _write(self, words: str, at: tuple[float, float], font: pygame.font.Font, colour=INK, centred=False) -> None:
        text = font.render(words, True, colour)
        x, y = at
        self._surface.blit(text, (x - text.get_width() / 2, y - text.get_height() / 2) if centred else at)

    def _numbers(self, game: Game, top: int) -> None:
        state, side = game.state, tile_size(game.state.size)
        tiles, level = state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN], state.levels[0]
        for room, colour in enumerate(level.colours[: level.n_rooms - 1].tolist(), start=1):
            for row, col in np.argwhere((tiles == KEY + colour) | (tiles == LOCKED_DOOR + colour)):
                if game.seen[row, col] or not game.has_fog:
                    at = col * side + 0.26 * side, top + row * side + 0.28 * side
                    self._write(str(room), at, self._small, (255, 255, 255), centred=True)

    def _facts(self, game: Game, left: int) -> int:
        level = game.state.levels[0]
        self._write(f"graph {game.graph.name}", (left, 14), self._large)
        held = [game.name_of(int(colour)) for n, colour in enumerate(level.colours) if int(level.keys) >> n & 1]
        lines = [
            (f"step {level.steps} of {level.max_steps}, shortest {game.shortest}", INK),
            (f"keys held: {', '.join(held) or 'none'}", INK),
            (f"{'the agent plays' if game.is_piloted else 'you play'}{', in fog' if game.has_fog else ''}", FAINT),
        ]
        if game.goal != NO_GOAL:
            lines.append((f"subgoal: {game.name_of(game.goal)}", INK))
        if game.has_hints:
            lines.append((f"oracle: {game.hint}", ACCENT))
        lines.append((game.message, GOOD if game.has_escaped or game.message.endswith("!") else ACCENT))
        top = 48
        for words, colour in lines:
            for part in _wrapped(words, self._normal, PANEL - 40):
                self._write(part, (left, top), self._normal, colour)
                top += 23
        return top

    def _tree(self, game: Game, left: int, top: int) -> int:
        graph, level = game.graph, game.state.levels[0]
        places = tree_places(graph.key_rooms)
        wide, deep = 1 + max(place[0] for place in places), 1 + max(place[1] for place in places)
        room_left = self._surface.get_height() - 26 * len(KEYS) - top - 16
        across, down = min(78.0, (PANEL - 40) / wide), min(78.0, room_left / deep)
        radius = int(max(8, min(18, across / 3.4, down / 3.4)))
        at = [(left + across * (column + 0.5), top + down * depth + radius + 6) for column, depth in places]
        here = int(rooms_of(game.state.levels, game.state.maps)[0])
        for room, home in enumerate(graph.key_rooms, start=1):
            pygame.draw.aaline(self._surface, FAINT, at[home], at[room])
        for room, home in enumerate(graph.key_rooms, start=1):
            colour = int(level.colours[room - 1])
            was_found = bool((int(level.keys) | int(level.doors)) >> room - 1 & 1)
            x, y = (at[home][0] + at[room][0]) / 2, (at[home][1] + at[room][1]) / 2
            box = pygame.Rect(0, 0, radius + 2, radius + 2)
            box.center = int(x), int(y)
            if game.goal == colour:
                pygame.draw.rect(self._surface, ACCENT, box.inflate(10, 10), 3, 5)
            pygame.draw.rect(self._surface, RGB[colour] if was_found else PAPER, box, 0, 3)
            pygame.draw.rect(self._surface, RGB[colour], box, 2, 3)
            self._write(str(room), box.center, self._small, (0, 0, 0) if was_found else INK, centred=True)
        for room, (x, y) in enumerate(at):
            is_open = room == 0 or bool(int(level.doors) >> room - 1 & 1)
            colour = RGB[int(level.colours[room - 1])] if room else FAINT
            is_wanted = room and game.goal == FIRST_DOOR_GOAL + int(level.colours[room - 1])
            if is_wanted or (room == graph.exit_room and game.goal == EXIT_GOAL):
                pygame.draw.circle(self._surface, ACCENT, (x, y), radius + 9, 3)
            if room == graph.exit_room:
                pygame.draw.circle(self._surface, GOOD, (x, y), radius + 4, 0 if game.has_escaped else 2)
            pygame.draw.circle(self._surface, colour if is_open else PAPER, (x, y), radius)
            pygame.draw.circle(self._surface, colour, (x, y), radius, 2)
            self._write(str(room or "0"), (x, y), self._small, (0, 0, 0) if is_open else INK, centred=True)
            if room == graph.exit_room:
                self._write("exit", (x + radius + 7, y - 7), self._small, GOOD)  # a door's key may be below
            if room == here:
                point = x - radius - 5, y
                pygame.draw.polygon(self._surface, RGB[0], [point, (point[0] - 11, y - 7), (point[0] - 11, y + 7)])
        return int(top + down * deep)


def _wrapped(words: str, font: pygame.font.Font, width: int) -> list[str]:
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if font.size(longer)[0] > width and lines[-1]:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines
