"""A meta-controller of one's own: python -m hierroom.train --meta own_meta_controller:NearestKeyFirst."""

import numpy as np

from hierroom.world.kernels import KEY, OPEN_DOOR


class NearestKeyFirst:
    """The nearest legal key as the crow flies; where there is none a door, then the exit."""

    def choose(self, observations, legal, situation):
        """[M] goal ids: 0 to 5 the keys by colour, 6 to 11 the doors, 12 the exit."""
        grids, rooms = situation.state.grids, situation.state.levels
        rank = np.tile(np.repeat([0, -200, -300], [6, 6, 1]), (len(legal), 1))
        for m, row, col in np.argwhere((grids >= KEY) & (grids < OPEN_DOOR)):
            rank[m, grids[m, row, col] - KEY] = -abs(row - rooms[m].row) - abs(col - rooms[m].col)
        return np.where(legal, rank, -999).argmax(axis=1)
