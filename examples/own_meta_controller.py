"""Two meta-controllers of one's own: a plain function of one level, and a class that chooses for all at once.

python -m hierroom.train --meta own_meta_controller:nearest
python -m hierroom.train --meta own_meta_controller:NearestKeyFirst
"""

import numpy as np


def nearest(level):
    """The nearest legal goal as the crow flies."""
    return min(level.legal_goals, key=lambda goal: goal.distance)


class NearestKeyFirst:
    """The nearest legal key as the crow flies; where there is none a door, then the exit."""

    def choose(self, observations, legal, situation):
        """[M] goal ids: 0 to 5 the keys by colour, 6 to 11 the doors, 12 the exit."""
        agents = np.stack([situation.levels["row"], situation.levels["col"]], axis=1)  # [M, 2]
        distances = abs(situation.levels["keys_at"] - agents[:, None]).sum(axis=2)  # [M, 6], by the room it opens
        ranks = situation.by_goal(-distances, np.full_like(distances, -200), np.full(len(legal), -300))
        return np.where(legal, ranks, -999).argmax(axis=1)
