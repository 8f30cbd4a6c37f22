"""A digest of all that happens in some environments, which must not depend on Numba."""

import hashlib

import numpy as np

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.worlds import random_kernels
from hierroom.worlds.escape_room import tiles
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.features import nearest_frontiers
from hierroom.worlds.escape_room.layout import MEMORIES, NO_MAPS, map_arrays
from hierroom.worlds.escape_room.level_map import LevelMap
from hierroom.worlds.escape_room.oracle import shortest_actions, shortest_lengths

NESTED = LevelMap.of(
    """
    ##########
    #r @R g G#
    #b  ####E#
    ##B##  ###
    #   #    #
    ##########
    """
)
GRAPHS = [NAMED_GRAPHS["a"], NAMED_GRAPHS["f"], GoalGraph((0, 1, 2, 0, 1, 2), 6)]


def trace() -> str:
    digest = hashlib.sha256()

    def record(array: np.ndarray) -> None:
        for name in array.dtype.names or ():
            digest.update(np.ascontiguousarray(array[name]))
        if array.dtype.names is None:
            digest.update(np.ascontiguousarray(array))

    for size, drop_key, maps in ((11, True, NO_MAPS), (19, False, NO_MAPS), (11, True, map_arrays([NESTED], 11))):
        settings = {"size": size, "drop_key": drop_key, "maps": maps}
        world = Engine(GRAPHS, 6, **settings, max_steps=70, seed=2**63 - 1, memories=MEMORIES)
        rng = np.random.default_rng(size)
        for actions in rng.choice(6, size=(150, 6), p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1]):
            record(world.step(actions))
            record(tiles.encode(world.outcomes["tiles"]))
            record(nearest_frontiers(world.state.levels, world.state.maps))
        uniforms = np.empty((6, 3))
        random_kernels.turn_uniforms(world.state.levels, np.arange(6), uniforms)
        record(uniforms)
        for goal in range(0, 13, 3):
            record(shortest_lengths(world.state, goal))
        for n in range(6):
            for action in shortest_actions(world.state[n]):
                actions = np.full(6, -1)
                actions[n] = action
                record(world.step_within_episode(actions))
        record(world.state.levels)
        record(world.state.grids)
        record(world.finals)
    return digest.hexdigest()


if __name__ == "__main__":
    print(trace())
