"""A real MiniGrid environment with one of our levels and our rules, to which the world is compared."""

from minigrid.core.grid import Grid
from minigrid.core.mission import MissionSpace
from minigrid.core.world_object import Door, Goal, Key, Wall
from minigrid.minigrid_env import MiniGridEnv

from hierroom.goals import COLOURS
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.layout import State


class MiniGridLevel(MiniGridEnv):
    """The level of a state in which the agent holds nothing and no door is open."""

    def __init__(self, state: State, **settings):
        self.start = state.copy()
        level = self.start.levels[0]
        self.can_drop = bool(level.can_drop)
        super().__init__(
            MissionSpace(lambda: "reach the exit"), grid_size=state.size, max_steps=int(level.max_steps), **settings
        )

    def _gen_grid(self, width, height):
        level = self.start.levels[0]
        self.grid = Grid(width, height)
        for row in range(height):
            for col in range(width):
                tile = self.start.grids[0, row + constants.MARGIN, col + constants.MARGIN]
                self.grid.set(col, row, make_object(tile))
        self.agent_pos = (int(level.col) - constants.MARGIN, int(level.row) - constants.MARGIN)
        self.agent_dir = int(level.direction)
        self.bag: list[Key] = []
        self.unlocked: set[str] = set()

    def _reward(self):
        return 1.0

    def step(self, action):
        front = self.front_pos
        thing = self.grid.get(*front)
        if action == constants.PICKUP and isinstance(thing, Key):
            self.bag.append(thing)
            self.grid.set(*front, None)
        elif action == constants.OPEN and isinstance(thing, Door) and thing.is_locked:
            if thing.color in [key.color for key in self.bag]:
                thing.is_locked, thing.is_open = False, True
                self.unlocked.add(thing.color)
        elif action == constants.DROP and self.can_drop and thing is None and self.carrying:
            self.grid.set(*front, self.carrying)
            self.bag.remove(self.carrying)
        useful = [key for key in self.bag if key.color not in self.unlocked]
        self.carrying = useful[-1] if useful else None
        moves = {constants.FORWARD: "forward", constants.LEFT: "left", constants.RIGHT: "right"}
        return super().step(self.actions[moves.get(int(action), "done")])


def make_object(tile):
    if tile == constants.EXIT:
        return Goal()
    if tile == constants.WALL:
        return Wall()
    if constants.KEY <= tile < constants.OPEN_DOOR:
        return Key(COLOURS[tile - constants.KEY])
    if constants.LOCKED_DOOR <= tile < constants.WALL:
        return Door(COLOURS[tile - constants.LOCKED_DOOR], is_locked=True)
    assert tile == constants.EMPTY
    return None
