"""Replay episodes of a workshop, name their goals and actions, and draw them as text and pictures."""

from __future__ import annotations

from collections.abc import Container, Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import NO_GOAL
from hierroom.support.errors import InputError
from hierroom.support.schema import Whole
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.workshop.layout import BENCH, PLACES, SHELF, WorkshopState
from hierroom.worlds.workshop.recipes import Recipes

PER_ROW = 8
"""Places of the shelf in a row of a picture."""
PAPER, WOOD, INK, GOAL_INK = (24, 24, 28), (120, 84, 52), (240, 240, 240), (255, 210, 90)


class WorkshopReplayer:
    """The `Replayer` of a `WorkshopTask`; a state is a `WorkshopState` of one environment."""

    def __init__(self, task: Any) -> None:
        self._task, self._book = task, task.book

    def identity(self, state: WorkshopState) -> tuple[int, int, int]:
        """Return the environments' seed, this one's index, and the number of episodes that it began before."""
        shop = state.shops[0]
        return int(shop.seed), int(shop.index), int(shop.episode)

    def max_steps(self, state: WorkshopState) -> int:
        """Return the number of steps after which the episode is truncated."""
        return int(state.shops[0].max_steps)

    def goal_name(self, state: WorkshopState, goal: int) -> str:
        """Return the name of a goal; -1 is no goal."""
        return "no goal" if goal == NO_GOAL else self._book.rules.names[goal]

    goal_label = goal_name
    """Goals mean the same in every episode."""

    def action_name(self, state: WorkshopState, action: int) -> str:
        """Return the name of a controller's action."""
        n_places = len(self._book.recipes.standing)
        if 0 <= action < n_places:
            return f"put {self._book.things[state.things[0, PLACES, action]]}"
        return {n_places: "work", n_places + 1: "clear"}.get(action, "illegal action")

    def replay(
        self, state: WorkshopState, actions: NDArray[np.integer], drawn: Container[int] | None = None
    ) -> Iterator[WorkshopState]:
        """Yield the state, then the state after each action."""
        config = EnvConfig(task=self._task, max_steps=self.max_steps(state))
        world = self._task.make_world(config, 1, autoreset=False)
        world.set_state(state)
        yield world.get_state()
        for action in actions:
            world.step(np.array([action], np.int64))
            yield world.get_state()

    def rules_state(self, state: WorkshopState) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
        """Return whether each goal [G] was achieved, and the count of each fact [F]."""
        achieved = int(state.shops[0].achieved) >> np.arange(self._book.recipes.n_goals) & 1
        counts = state.things[0, SHELF].astype(np.int64) + state.things[0, BENCH]
        return achieved > 0, counts[: len(self._book.rules.facts)]

    def tile_size(self, state: WorkshopState) -> int:
        """Return a side length of places, in pixels, for readable text."""
        return 80

    window_tile_size = tile_size

    def text(self, state: WorkshopState, goal: int = NO_GOAL) -> str:
        """Draw a state for a terminal: the shelf in its order, the bench, the step, and the goal with its recipe."""
        shop, names = _only(state)[0], self._book.things
        counts = {names[thing]: int(state.things[0, SHELF, thing]) for thing in self._places(state)}
        shelf = " | ".join(f"{place} {thing} x{n}" for place, (thing, n) in enumerate(counts.items()))
        lines = [
            f"shelf: {shelf}",
            f"bench: {self._in_words(state.things[0, BENCH])}",
            f"step {shop.steps} of {shop.max_steps}",
        ]
        if goal != NO_GOAL:
            lines.append(f"subgoal: {self.goal_name(state, goal)} = {self._recipe(goal)}")
        return "\n".join(lines)

    def picture(self, state: WorkshopState, goal: int, tile_size: int, title: str = "") -> NDArray[np.uint8]:
        """Draw a state [H, W, 3] uint8: the shelf in rows, the bench below it, and the goal with its recipe."""
        from PIL import Image, ImageDraw

        _only(state)
        Whole(1).check(tile_size, "tile_size")
        places, things = self._places(state), state.things[0]
        n_rows, n_bench_rows = (-(-n // PER_ROW) for n in (len(places), min(len(places), self._book.recipes.room)))
        line, side = max(12, int(tile_size) // 3), int(tile_size)
        width, bench_top = PER_ROW * side, line + n_rows * side
        height = bench_top + n_bench_rows * side + 2 * line
        image = Image.new("RGB", (width, height), PAPER)
        draw = ImageDraw.Draw(image)

        def write(text: str, x: float, y: float, ink: tuple[int, int, int], size: float) -> None:
            draw.text((x, y), text, fill=ink, font=_font(max(8, round(size))), anchor="mm")

        def show(shown: list[int], top: int, counts: NDArray[np.uint8]) -> None:
            for number, thing in enumerate(shown):
                x, y = number % PER_ROW * side, top + number // PER_ROW * side
                ink = INK if counts[thing] else WOOD
                draw.rectangle((x + 2, y + 2, x + side - 3, y + side - 3), outline=ink, width=max(1, side // 40))
                write(self._book.things[thing], x + side / 2, y + side * 0.35, ink, side / 7)
                write(str(counts[thing]), x + side / 2, y + side * 0.7, ink, side / 4)

        write(title, width / 2, line / 2, INK, line * 0.6)
        show(places, line, things[SHELF])
        draw.rectangle((0, bench_top, width, bench_top + line - 1), fill=WOOD)
        write("bench", width / 2, bench_top + line / 2, INK, line * 0.6)
        show(np.flatnonzero(things[BENCH]).tolist(), bench_top + line, things[BENCH])
        if goal != NO_GOAL:
            words = f"subgoal: {self.goal_name(state, goal)} = {self._recipe(goal)}"
            write(words, width / 2, height - line / 2, GOAL_INK, line * 0.6)
        return np.asarray(image)

    def _places(self, state: WorkshopState) -> list[int]:
        return state.things[0, PLACES, : len(self._book.recipes.standing)].tolist()

    def _recipe(self, goal: int) -> str:
        recipes: Recipes = self._book.recipes
        if not 0 <= goal < recipes.n_goals:
            raise InputError(
                f"a goal must be a whole number from 0 to {recipes.n_goals - 1}, or -1 for none, not {goal}"
            )
        return " or ".join(map(self._in_words, recipes.asks[recipes.goals == goal]))

    def _in_words(self, counts: NDArray[np.uint8]) -> str:
        there = [(n, thing) for n, thing in zip(counts.tolist(), self._book.things, strict=True) if n]
        return ", ".join(f"{n} {thing}" if n > 1 else thing for n, thing in there) or "nothing"


def _only(state: WorkshopState) -> np.ndarray:
    if len(state) != 1:
        raise InputError(f"a picture shows one environment, but the state holds {len(state)}: index the state first")
    return state.shops


@lru_cache(maxsize=16)
def _font(size: int):
    from PIL import ImageFont

    return ImageFont.load_default(size=size)
