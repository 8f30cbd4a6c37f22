"""Two custom meta-controllers: a class that chooses for all environments, and a function of one level.

python -m hierroom train --meta own_meta_controller:NearestKeyFirst
python -m hierroom train --meta own_meta_controller:nearest
"""

import numpy as np


class NearestKeyFirst:
    """The nearest legal key by Manhattan distance; where there is none a door, then the exit."""

    def choose(self, observations, legal, situation):
        """Return goal ids [M]: 0 to 5 the keys by colour, 6 to 11 the doors, 12 the exit."""
        agents = np.stack([situation.levels["row"], situation.levels["col"]], axis=1)  # [M, 2]
        distances = abs(situation.levels["keys_at"] - agents[:, None]).sum(axis=2)  # [M, 6], column r - 1 for key r
        ranks = situation.by_goal(-distances, np.full_like(distances, -200), np.full(len(legal), -300))
        return np.where(legal, ranks, -999).argmax(axis=1)


def nearest(level):
    """Return the nearest legal goal by Manhattan distance, walls ignored."""
    return min(level.legal_goals, key=lambda goal: goal.distance)
